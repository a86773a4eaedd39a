"""Fields of a scenario: quantities written with their units, checked and turned into SI numbers as they are read.

In the place of a number may stand a distribution. It is read as its mean, and noted in the context of the validation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo

from hsv.base.errors import QuantityError
from hsv.base.units import has_unit, parse_quantity, to_paper
from hsv.flight.distribution import Distribution, read_distribution
from hsv.model.vehicle import Vehicle


@dataclass(frozen=True)
class Reading:
    """The context in which a scenario is validated."""

    vehicle: Vehicle
    """The scenario's, whose envelope and sets of inertial coupling hold"""
    drawn: dict[int, Distribution] = field(default_factory=dict)
    """Distributions that were found, by the identity of the tables that they are written in"""


def relative_change(low: float, high: float, shown: str) -> BeforeValidator:
    """Return what reads a relative change from ``low`` to ``high``, in percent: 5 might be 5 %, and would be 500 %."""

    def parse(text: object, info: ValidationInfo) -> float:
        ends, value = _read(text, "1", info)
        for given in next(iter(text.values())) if isinstance(text, dict) else (text,):
            if not has_unit(given):
                raise QuantityError(f"{info.field_name} = {given!r}: the unit is missing, expected one such as '+5 %'")
        if ends[0] < low or ends[1] > high:
            raise QuantityError(f"{info.field_name} = {text!r}: expected {shown}")
        return value

    return BeforeValidator(parse)


def quantity(unit: str, low: float | None = None, high: float | None = None, shown: str = "") -> BeforeValidator:
    """Return what reads a quantity in ``unit`` from ``low`` to ``high`` (SI); ``shown`` says that range in words."""

    def parse(text: object, info: ValidationInfo) -> float:
        ends, value = _read(text, unit, info)
        if (low is not None and ends[0] < low) or (high is not None and ends[1] > high):
            raise QuantityError(f"{info.field_name} = {text!r}: expected {shown}")
        return value

    return BeforeValidator(parse)


def enveloped(axis: str, unit: str) -> BeforeValidator:
    """Return what reads an altitude or a velocity inside the envelope of the scenario's vehicle."""

    def parse(text: object, info: ValidationInfo) -> float:
        ends, value = _read(text, unit, info)
        low, high = getattr(_reading(info).vehicle, f"{axis}_range")
        if not low <= ends[0] <= ends[1] <= high:
            raise QuantityError(f"{axis} = {text!r}: expected {envelope((low, high), unit)}")
        return value

    return BeforeValidator(parse)


def envelope(limits: tuple[float, float], unit: str) -> str:
    """Return the limits (SI) of the flight envelope on an axis with this SI ``unit`` in words, in feet."""
    low, high = (to_paper(limit, unit) for limit in limits)
    return f"{low[0]:.0f} {low[1]} to {high[0]:.0f} {high[1]}, the flight envelope"


def quantities(unit: str) -> BeforeValidator:
    """Return what reads one quantity in ``unit`` or several."""

    def parse(given: object, info: ValidationInfo) -> tuple[float, ...]:
        texts = given if isinstance(given, list | tuple) else [given]
        return tuple(_read(text, unit, info)[1] for text in texts)

    return BeforeValidator(parse)


def _read(text: object, unit: str, info: ValidationInfo) -> tuple[tuple[float, float], float]:
    """Return the least and the largest value that ``text`` admits, and the number or mean, in ``unit``."""
    name = str(info.field_name)
    if isinstance(text, dict):
        drawn = _reading(info).drawn[id(text)] = read_distribution(text, unit, name)
        return (drawn.low, drawn.high), drawn.middle
    value = parse_quantity(text, unit, name)
    return (value, value), value


def _coupling(given: object, info: ValidationInfo) -> str:
    """Return a set of inertial coupling of the scenario's vehicle, or a multiple of the derived."""
    vehicle = _reading(info).vehicle
    if isinstance(given, dict):
        (least, _), given = _read(given, "1", info)
        vehicle.coupling_name(least)
    return vehicle.coupling_name(given)


def _reading(info: ValidationInfo) -> Reading:
    assert isinstance(info.context, Reading)
    return info.context


Coupling = Annotated[str, BeforeValidator(_coupling)]
Time = Annotated[float, quantity("s", 0.0, 1e5, shown="a time from 0 s to 100000 s")]
Frequencies = Annotated[tuple[float, ...], quantities("rad/s")]
Numbers = Annotated[tuple[float, ...], quantities("1")]


class Table(BaseModel):
    """A table of a scenario: no key but those known."""

    model_config = ConfigDict(extra="forbid", frozen=True)
