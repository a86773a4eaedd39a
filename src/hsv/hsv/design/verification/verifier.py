"""Verifying a design file: every claim of its certificate recomputed, the first that fails named."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from hsv.control.design_file import ControlDesign, read_design
from hsv.design.certificate import certificate_path, read_certificate
from hsv.design.inputs import inputs_from_report
from hsv.design.model import polytopic_model
from hsv.design.verification.claims import Claim, Subject, gathered
from hsv.design.verification.gains import feedback_claims, nominal_claims
from hsv.design.verification.model import input_claims, model_claims
from hsv.design.verification.tube import flight_claims, sequence_claims, set_claims
from hsv.errors import DesignError
from hsv.vehicle.parameters import vehicle_parameters

Progress = Callable[[str, int, int], None]


def _recomputed_model(subject: Subject) -> Iterable[Claim]:
    return model_claims(subject, polytopic_model(subject.inputs.model, vehicle_parameters("decoupled")))


QUICK = {
    "inputs": input_claims,
    "feedback gain": feedback_claims,
    "nominal gains": nominal_claims,
    "invariant set": set_claims,
}
"""What a node can afford at start: tens of milliseconds."""

SLOW = {
    "polytopic model": _recomputed_model,
    "flights": flight_claims,
    "random sequences": sequence_claims,
}
"""What takes seconds."""


def load_subject(path: Path, design: ControlDesign | None = None) -> Subject:
    """Return the parameter file at ``path`` with its certificate; ``design``, if given, in place of what the file says.

    Raises:
        DesignError: A file that is missing or malformed.
    """
    certificate = read_certificate(certificate_path(path))
    return Subject(design or read_design(path), certificate, inputs_from_report(certificate["inputs"]))


def verify(subject: Subject, quick: bool = False, progress: Progress | None = None) -> list[Claim]:
    """Return every claim recomputed; with ``quick`` only those that need neither flights, sequences nor the vehicle."""
    parts = QUICK if quick else QUICK | SLOW
    claims: list[Claim] = []
    for name, part in parts.items():
        if progress:
            progress(name, 0, 1)
        claims += gathered(name, lambda part=part: part(subject))  # type: ignore[misc]
        if progress:
            progress(name, 1, 1)
    return claims


def require(claims: Iterable[Claim]) -> None:
    """Raise DesignError naming the first claim that fails, if any."""
    for claim in claims:
        if not claim.ok:
            raise DesignError(f"claim fails: {claim}")
