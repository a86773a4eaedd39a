"""Claims: what is recomputed, what came out, what was expected."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.design.verification.tolerances import PARAMETERS, TOLERANCES, entry_size
from hsv.errors import DesignError
from hsv.vehicle.vehicle import Vehicle, load_vehicle

if TYPE_CHECKING:
    from hsv.design.inputs import DesignInputs
    from hsv.design.model import DesignModel


@dataclass(frozen=True)
class Claim:
    """One statement of a design, recomputed: ``value`` is what came out, ``expected`` says in words what was due.

    ``required``: a design that fails it must not fly; other claims tell that it is not the one that was written.
    """

    name: str
    value: float | str
    expected: str
    ok: bool
    required: bool = False

    def __str__(self) -> str:
        return f"{self.name}: {self.shown}, expected {self.expected}"

    @property
    def shown(self) -> str:
        """What came out, as text."""
        return self.value if isinstance(self.value, str) else f"{self.value:.6g}"


@dataclass(frozen=True)
class Subject:
    """What is verified: the design as it flies, and its certificate."""

    design: ControlDesign
    certificate: dict[str, Any]

    @cached_property
    def inputs(self) -> DesignInputs:
        """The design inputs in the certificate, checked. Units and models take a moment to import: not for nodes."""
        from hsv.design.inputs import inputs_from_report

        return inputs_from_report(self.certificate["inputs"])

    @cached_property
    def vehicle(self) -> Vehicle:
        """The vehicle in the certificate; where there is none, the default one."""
        values = self.certificate["inputs"].get("vehicle")
        if not isinstance(values, dict | None):
            raise DesignError(f"inputs.vehicle = {values!r}: expected the parameters of a vehicle")
        return Vehicle.from_parameters(values) if values else load_vehicle()

    @cached_property
    def model(self) -> DesignModel:
        """The polytopic model recomputed from those inputs and the vehicle; a second or two. Not for nodes."""
        from hsv.design.model import polytopic_model

        return polytopic_model(self.inputs.model, self.vehicle, self.design.notch)


def required(claim: Claim) -> Claim:
    """Return ``claim`` as one without which a design must not fly."""
    return replace(claim, required=True)


def same(name: str, value: Any, expected: Any, tolerance: str, size: Any = 1.0) -> Claim:
    """Claim that every entry of ``value`` is that of ``expected``, within a tolerance named in the table."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    if value.shape != expected.shape:
        return Claim(name, f"shape {value.shape}", f"shape {expected.shape}", False)
    allowed = TOLERANCES[tolerance].allowed(expected, size)
    shares = np.abs(value - expected) / allowed
    shares = np.where(np.isnan(shares), np.inf, shares)
    if shares.max(initial=0.0) <= 1.0:
        return Claim(name, float(shares.max(initial=0.0)), "at most 1 tolerance", True)
    worst = np.unravel_index(int(np.argmax(shares)), shares.shape)
    where = "" if value.ndim == 0 else f"[{', '.join(str(i) for i in worst)}]"
    return Claim(f"{name}{where}", float(value[worst]), f"{float(expected[worst])!r}", False)


def same_parameter(
    subject: Subject, parameter: str, value: Any, expected: Any, name: str = "", index: Any = ...
) -> Claim:
    """Claim that every entry of ``value``, a parameter of the design file or its part ``[index]``, is as expected."""
    size = entry_size(parameter, subject.certificate)[index]
    return same(name or parameter, value, expected, PARAMETERS[parameter], size)


def at_most(name: str, value: float, limit: float) -> Claim:
    """Claim that ``value`` is at most ``limit``; not a number is not."""
    return Claim(name, float(value), f"at most {limit:g}", bool(value <= limit))


def above(name: str, value: float, limit: float) -> Claim:
    """Claim that ``value`` is above ``limit``; not a number is not."""
    return Claim(name, float(value), f"above {limit:g}", bool(value > limit))


def inverse(Q: np.ndarray) -> np.ndarray:
    """Return Q^-1, symmetric."""
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


def gathered(name: str, claims: Callable[[], Iterable[Claim]]) -> list[Claim]:
    """Return the claims; an error on the way becomes the last claim, which fails under ``name``."""
    done: list[Claim] = []
    try:
        done.extend(claims())
    # A certificate may hold anything anywhere.
    except (DesignError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        missing = isinstance(error, KeyError)
        value = f"no field {error}" if missing else str(error)
        done.append(Claim(name, value, "to be recomputable", False, required=True))
    return done


def require(claims: Iterable[Claim]) -> None:
    """Raise DesignError naming the first claim that fails, if any."""
    for claim in claims:
        if not claim.ok:
            raise DesignError(f"claim fails: {claim}")
