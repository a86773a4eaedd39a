"""Verifying a design file: every claim of its certificate recomputed, the first that fails named."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hsv.control.design_file import read_design
from hsv.design.certificate import certificate_path, read_certificate
from hsv.design.verification.adjustable import adjustable_claims
from hsv.design.verification.claims import Claim, Subject, gathered
from hsv.design.verification.flights import flight_claims, sequence_claims
from hsv.design.verification.model import model_claims
from hsv.design.verification.quick import QUICK, Part

Progress = Callable[[str, int, int], None]


RECOMPUTED: dict[str, Part] = {"polytopic model": model_claims, "adjustable design": adjustable_claims}
"""What needs units, models and the vehicle, by part; a second or two."""

FLOWN: dict[str, Part] = {"flights": flight_claims, "random sequences": sequence_claims}
"""What takes longer, by part."""


def load_subject(path: Path) -> Subject:
    """Return the parameter file at ``path`` with its certificate.

    Raises:
        DesignError: A file that is missing or malformed.
    """
    return Subject(read_design(path), read_certificate(certificate_path(path)))


def verify(subject: Subject, quick: bool = False, progress: Progress | None = None) -> dict[str, list[Claim]]:
    """Return every claim recomputed, by part; with ``quick`` only those that need no flights or random sequences."""
    parts = QUICK | RECOMPUTED | ({} if quick else FLOWN)
    claims: dict[str, list[Claim]] = {}
    for name, part in parts.items():
        if progress:
            progress(name, 0, 1)
        claims[name] = gathered(name, partial(part, subject))
        if progress:
            progress(name, 1, 1)
    return claims
