"""Verification of a design file: everything that its certificate states is recomputed."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from hsv.base.processes import Progress
from hsv.control.design import certificate_path, read_certificate, read_design
from hsv.design.verification.adjustable import adjustable_checks
from hsv.design.verification.checks import Check, Subject, gathered
from hsv.design.verification.flights import flight_checks, sequence_checks
from hsv.design.verification.invariant_set import counter_example_checks
from hsv.design.verification.model import model_checks
from hsv.design.verification.quick import QUICK, Part

RECOMPUTED: dict[str, Part] = {
    "polytopic model": model_checks,
    "adjustable design": adjustable_checks,
    "counter-examples": counter_example_checks,
}
"""Checks by section that need units, models and the vehicle; they take a second or two."""

FLOWN: dict[str, Part] = {"flights": flight_checks, "random sequences": sequence_checks}
"""Checks by section that take longer."""


def load_subject(path: Path) -> Subject:
    """Return the parameter file at ``path`` with its certificate.

    Raises:
        DesignError: A file that is missing or malformed.
    """
    return Subject(read_design(path), read_certificate(certificate_path(path)))


def verify(subject: Subject, quick: bool = False, progress: Progress | None = None) -> dict[str, list[Check]]:
    """Return every check recomputed, by part; with ``quick`` only those that need no flights or random sequences."""
    parts = QUICK | RECOMPUTED | ({} if quick else FLOWN)
    checks: dict[str, list[Check]] = {}
    for name, part in parts.items():
        if progress:
            progress(name, 0, 1)
        checks[name] = gathered(name, partial(part, subject))
        if progress:
            progress(name, 1, 1)
    return checks
