"""Fields of a scenario: quantities written with their units, checked and turned into SI numbers as they are read.

In the place of a number may stand a distribution. It is read as its mean, and noted in the context of the validation,
a dictionary, by the identity of the table that it is written in.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo

from hsv.errors import QuantityError
from hsv.simulation.distribution import read_distribution
from hsv.units import parse_quantity


def quantity(unit: str, low: float | None = None, high: float | None = None, shown: str = "") -> BeforeValidator:
    """Return what reads a quantity in ``unit`` from ``low`` to ``high`` (SI); ``shown`` says that range in words."""

    def parse(text: object, info: ValidationInfo) -> float:
        ends, value = _read(text, unit, info)
        if (low is not None and ends[0] < low) or (high is not None and ends[1] > high):
            raise QuantityError(f"{info.field_name} = {text!r}: expected {shown}")
        return value

    return BeforeValidator(parse)


def quantities(unit: str) -> BeforeValidator:
    """Return what reads one quantity in ``unit`` or several."""

    def parse(given: object, info: ValidationInfo) -> tuple[float, ...]:
        texts = given if isinstance(given, list | tuple) else [given]
        return tuple(_read(text, unit, info)[1] for text in texts)

    return BeforeValidator(parse)


def _read(text: object, unit: str, info: ValidationInfo) -> tuple[tuple[float, float], float]:
    """Return the least and the largest value that ``text`` admits, and the number or mean, in ``unit``."""
    field = str(info.field_name)
    if isinstance(text, dict) and info.context is not None:
        drawn = info.context[id(text)] = read_distribution(text, unit, field)
        return (drawn.low, drawn.high), drawn.middle
    value = parse_quantity(text, unit, field)
    return (value, value), value


Time = Annotated[float, quantity("s", 0.0, 1e5, shown="a time from 0 s to 100000 s")]
Frequencies = Annotated[tuple[float, ...], quantities("rad/s")]
Numbers = Annotated[tuple[float, ...], quantities("1")]


class Table(BaseModel):
    """A table of a scenario: no key but those known."""

    model_config = ConfigDict(extra="forbid", frozen=True)
