"""Fields of a scenario: quantities written with their units, checked and turned into SI numbers as they are read."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo

from hsv.errors import QuantityError
from hsv.units import parse_quantity


def quantity(unit: str, low: float | None = None, high: float | None = None, shown: str = "") -> BeforeValidator:
    """Return what reads a quantity in ``unit`` from ``low`` to ``high`` (SI); ``shown`` says that range in words."""

    def parse(text: object, info: ValidationInfo) -> float:
        value = parse_quantity(text, unit, str(info.field_name))
        if (low is not None and value < low) or (high is not None and value > high):
            raise QuantityError(f"{info.field_name} = {text!r}: expected {shown}")
        return value

    return BeforeValidator(parse)


def quantities(unit: str) -> BeforeValidator:
    """Return what reads one quantity in ``unit`` or several."""

    def parse(given: object, info: ValidationInfo) -> tuple[float, ...]:
        texts = given if isinstance(given, list | tuple) else [given]
        return tuple(parse_quantity(text, unit, str(info.field_name)) for text in texts)

    return BeforeValidator(parse)


Time = Annotated[float, quantity("s", 0.0, 1e5, shown="a time from 0 s to 100000 s")]
Frequencies = Annotated[tuple[float, ...], quantities("rad/s")]
Numbers = Annotated[tuple[float, ...], quantities("1")]


class Table(BaseModel):
    """A table of a scenario: no key but those known."""

    model_config = ConfigDict(extra="forbid", frozen=True)
