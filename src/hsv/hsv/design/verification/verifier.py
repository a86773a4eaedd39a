"""Verifying a design file: every claim of its certificate recomputed, the first that fails named."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from hsv.control.design_file import read_design
from hsv.design.certificate import certificate_path, read_certificate
from hsv.design.model import polytopic_model
from hsv.design.verification.adjustable import adjustable_claims
from hsv.design.verification.claims import Claim, Subject, gathered
from hsv.design.verification.flights import flight_claims, sequence_claims
from hsv.design.verification.model import model_claims
from hsv.design.verification.quick import QUICK, Part
from hsv.vehicle.parameters import vehicle_parameters

Progress = Callable[[str, int, int], None]


def _recomputed_model(subject: Subject) -> Iterable[Claim]:
    return model_claims(
        subject, polytopic_model(subject.inputs.model, vehicle_parameters("decoupled"), subject.design.notch)
    )


SLOW: dict[str, Part] = {
    "polytopic model": _recomputed_model,
    "adjustable design": adjustable_claims,
    "flights": flight_claims,
    "random sequences": sequence_claims,
}
"""What takes seconds, by part."""


def load_subject(path: Path) -> Subject:
    """Return the parameter file at ``path`` with its certificate.

    Raises:
        DesignError: A file that is missing or malformed.
    """
    return Subject(read_design(path), read_certificate(certificate_path(path)))


def verify(subject: Subject, quick: bool = False, progress: Progress | None = None) -> dict[str, list[Claim]]:
    """Return every claim recomputed, by part; with ``quick`` only those that need no flights, sequences or vehicle."""
    parts = QUICK if quick else QUICK | SLOW
    claims: dict[str, list[Claim]] = {}
    for name, part in parts.items():
        if progress:
            progress(name, 0, 1)
        claims[name] = gathered(name, partial(part, subject))
        if progress:
            progress(name, 1, 1)
    return claims
