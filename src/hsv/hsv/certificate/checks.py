"""Checks of a design: each compares a number or text, read from its files or recomputed, with what is expected."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.certificate.tolerances import PARAMETERS, TOLERANCES, entry_size
from hsv.control.design import ControlDesign
from hsv.control.design_file import certificate_path, read_certificate, read_design
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES
from hsv.model.vehicle import Vehicle, load_vehicle


@dataclass(frozen=True)
class Check:
    """The result of one check: the ``value`` found, a description of the ``expected`` one, and whether they agree.

    A design that fails a ``required`` check must not fly; before a flight, another failing check is only a warning.
    ``fields`` are the paths of the fields of the certificate that the check covers.
    """

    name: str
    value: float | str
    expected: str
    ok: bool
    required: bool = False
    fields: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}: {self.shown}, expected {self.expected}"

    @property
    def shown(self) -> str:
        """The value found, as text; a number has six significant digits."""
        return self.value if isinstance(self.value, str) else f"{self.value:.6g}"


Checks = Iterable[Check]


@dataclass(frozen=True)
class Subject:
    """A design to verify: its numbers from the design file, and its certificate."""

    design: ControlDesign
    certificate: dict[str, Any]

    def stated(self, field: str) -> Any:
        """Return the value of a ``field`` of the certificate, given by its path, e.g. ``"nominal.0.Q"``."""
        found: Any = self.certificate
        for key in field.split("."):
            found = found[int(key) if isinstance(found, list) else key]
        return found

    def count(self, field: str, limit: int) -> int:
        """Return the count in a ``field`` of the certificate; a ``limit`` bounds the work that a file can cause.

        Raises:
            DesignError: The field is not an integer from 1 to ``limit``.
        """
        found = self.stated(field)
        if not isinstance(found, int) or not 0 < found <= limit:
            raise DesignError(f"{field} = {found!r}: expected an integer from 1 to {limit}")
        return found

    @cached_property
    def vehicle(self) -> Vehicle:
        """The vehicle in the certificate, or the default vehicle if the certificate contains none."""
        values = self.certificate["inputs"].get("vehicle")
        if not isinstance(values, dict | None):
            raise DesignError(f"inputs.vehicle = {values!r}: expected the parameters of a vehicle")
        return Vehicle.from_parameters(values) if values else load_vehicle()


def load_subject(path: Path) -> Subject:
    """Return the design in the parameter file at ``path``, with the certificate next to the file.

    Raises:
        DesignError: One of the files is missing or malformed.
    """
    return Subject(read_design(path), read_certificate(certificate_path(path)))


def same(name: str, value: Any, expected: Any, tolerance: str, size: Any = 1.0) -> Check:
    """Return the check that every entry of the array ``value`` equals that of ``expected``, within a tolerance.

    ``tolerance`` is a key of :data:`hsv.certificate.tolerances.TOLERANCES`; ``size`` is the typical magnitude of the
    entries.
    """
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    if value.shape != expected.shape:
        return Check(name, f"shape {value.shape}", f"shape {expected.shape}", False)
    shares = np.abs(value - expected) / TOLERANCES[tolerance].allowed(expected, size)
    shares = np.where(np.isnan(shares), np.inf, shares)
    if shares.max(initial=0.0) <= 1.0:
        return Check(name, float(shares.max(initial=0.0)), "at most 1 tolerance", True)
    worst = np.unravel_index(int(np.argmax(shares)), shares.shape)
    where = "" if value.ndim == 0 else f"[{', '.join(str(i) for i in worst)}]"
    return Check(f"{name}{where}", float(value[worst]), f"{float(expected[worst])!r}", False)


def recomputed(subject: Subject, field: str, value: Any, tolerance: str) -> Check:
    """Return the check that a ``field`` of the certificate has the recomputed ``value``; see :func:`same`."""
    return replace(same(field, subject.stated(field), value, tolerance), fields=(field,))


def equal(subject: Subject, field: str, expected: Any) -> Check:
    """Return the check that a ``field`` of the certificate equals ``expected`` exactly; not for arrays of numbers."""
    found = subject.stated(field)
    return Check(field, repr(found), repr(expected), found == expected, fields=(field,))


def parameter(
    subject: Subject,
    name: str,
    value: Any,
    expected: Any,
    shown: str = "",
    index: Any = ...,
    fields: Sequence[str] = (),
) -> Check:
    """Return the check that the ``value`` of the design parameter ``name`` equals ``expected``, within its tolerance.

    ``value`` is the array of the parameter or, with an ``index``, only this part of it. The check is named ``shown``
    or, if that is empty, ``name``; it covers these ``fields`` of the certificate.
    """
    size = entry_size(name, subject.certificate)[index]
    return replace(same(shown or name, value, expected, PARAMETERS[name], size), fields=tuple(fields))


def at_most(name: str, value: float, limit: float) -> Check:
    """Return the check that ``value`` is at most ``limit``; NaN fails."""
    return Check(name, float(value), f"at most {limit:g}", bool(value <= limit))


def at_least(name: str, value: float, limit: float) -> Check:
    """Return the check that ``value`` is at least ``limit``; NaN fails."""
    return Check(name, float(value), f"at least {limit:g}", bool(value >= limit))


def above(name: str, value: float, limit: float) -> Check:
    """Return the check that ``value`` is above ``limit``; NaN fails."""
    return Check(name, float(value), f"above {limit:g}", bool(value > limit))


def required(check: Check) -> Check:
    """Return a copy of ``check`` that is required."""
    return replace(check, required=True)


def gathered(name: str, checks: Callable[[], Checks]) -> Iterator[Check]:
    """Yield the results of ``checks``; if an error ends them, the last is a failed, required check ``name``."""
    try:
        yield from checks()
    # Any field of a certificate may have any type and value.
    except (DesignError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        missing = isinstance(error, KeyError)
        value = f"no field {error}" if missing else str(error)
        yield Check(name, value, "to be recomputable", False, required=True)


_SCALES = [*STATE_NAMES[:N_RIGID], *INPUT_NAMES]

STATED = {
    "versions": "names the packages that computed the design; nothing follows from them",
    "inputs.model.tensor_product.tolerance": "any value below the least singular value kept gives the same model",
    "inputs.disturbance.fault_window": "held by flights at drawn times, which are a sample",
    "inputs.invariant_set.contraction": "values that were tried; that of the set is checked",
    **{
        f"inputs.invariant_set.{'input' if name in INPUT_NAMES else 'state'}_scale.{name}": "weighs the sets searched"
        for name in _SCALES
    },
}
"""Fields of a certificate that no check recomputes: the reason for each."""


def under(field: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return the paths of the fields ``names`` of the table ``field``."""
    return tuple(f"{field}.{name}" for name in names)


def field_checks(subject: Subject, checks: Iterable[Check], later: Iterable[str] = ()) -> Checks:
    """Check that every field of the certificate is known: one of the ``checks`` or of :data:`STATED` covers it.

    ``later`` are the fields of checks that were not made.
    """
    held = {*STATED, *later, *(field for check in checks for field in check.fields)}
    for leaf in leaves(subject.certificate):
        if leaf not in held:
            yield Check(leaf, "unknown field", "none of that name", False, required=True)
    for field in STATED:
        subject.stated(field)


def leaves(value: Any, field: str = "") -> Iterator[str]:
    """Yield the path of every field in nested tables, e.g. ``"nominal.0.Q"``; an array of numbers is one field."""
    nested = value.items() if isinstance(value, dict) else enumerate(value) if _tables(value) else ()
    if not nested:
        yield field
    for key, inner in nested:
        yield from leaves(inner, f"{field}.{key}" if field else str(key))


def _tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)
