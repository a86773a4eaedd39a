"""Checks of a design: an item that is recomputed, the value found, and the value expected."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.design.verification.tolerances import PARAMETERS, TOLERANCES, entry_size
from hsv.model.vehicle import Vehicle, load_vehicle

if TYPE_CHECKING:
    from hsv.design.inputs import DesignInputs
    from hsv.design.model import DesignModel


@dataclass(frozen=True)
class Check:
    """One item of a design, recomputed: ``value`` is the value found, ``expected`` describes the expected one in words.

    A design that fails a ``required`` check must not fly; other checks only show that it is not the design as written.
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
        """The value found, as text."""
        return self.value if isinstance(self.value, str) else f"{self.value:.6g}"


@dataclass(frozen=True)
class Subject:
    """A design to verify: the design as it is flown, and its certificate."""

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


def required(check: Check) -> Check:
    """Return ``check`` as a required one."""
    return replace(check, required=True)


def same(name: str, value: Any, expected: Any, tolerance: str, size: Any = 1.0) -> Check:
    """Return the check that every entry of ``value`` equals that of ``expected``, within a tolerance of the table."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    if value.shape != expected.shape:
        return Check(name, f"shape {value.shape}", f"shape {expected.shape}", False)
    allowed = TOLERANCES[tolerance].allowed(expected, size)
    shares = np.abs(value - expected) / allowed
    shares = np.where(np.isnan(shares), np.inf, shares)
    if shares.max(initial=0.0) <= 1.0:
        return Check(name, float(shares.max(initial=0.0)), "at most 1 tolerance", True)
    worst = np.unravel_index(int(np.argmax(shares)), shares.shape)
    where = "" if value.ndim == 0 else f"[{', '.join(str(i) for i in worst)}]"
    return Check(f"{name}{where}", float(value[worst]), f"{float(expected[worst])!r}", False)


def same_parameter(
    subject: Subject, parameter: str, value: Any, expected: Any, name: str = "", index: Any = ...
) -> Check:
    """Return the check of every entry of ``value``, a parameter of the design file or its part ``[index]``."""
    size = entry_size(parameter, subject.certificate)[index]
    return same(name or parameter, value, expected, PARAMETERS[parameter], size)


def at_most(name: str, value: float, limit: float) -> Check:
    """Return the check that ``value`` is at most ``limit``; NaN fails."""
    return Check(name, float(value), f"at most {limit:g}", bool(value <= limit))


def above(name: str, value: float, limit: float) -> Check:
    """Return the check that ``value`` is above ``limit``; NaN fails."""
    return Check(name, float(value), f"above {limit:g}", bool(value > limit))


def inverse(Q: np.ndarray) -> np.ndarray:
    """Return Q^-1, symmetric."""
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


def gathered(name: str, checks: Callable[[], Iterable[Check]]) -> list[Check]:
    """Return the checks; an error in them becomes the last check, which fails under ``name``."""
    done: list[Check] = []
    try:
        done.extend(checks())
    # A certificate may hold anything anywhere.
    except (DesignError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        missing = isinstance(error, KeyError)
        value = f"no field {error}" if missing else str(error)
        done.append(Check(name, value, "to be recomputable", False, required=True))
    return done


def require(checks: Iterable[Check]) -> None:
    """Raise DesignError naming the first check that fails, if any."""
    for check in checks:
        if not check.ok:
            raise DesignError(f"check fails: {check}")
