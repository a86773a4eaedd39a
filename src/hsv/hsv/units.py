"""The edge between quantities with units, as people write them, and the SI numbers used everywhere inside."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from hsv.errors import QuantityError

if TYPE_CHECKING:
    import pint

PAPER_UNITS = {
    "m": "ft",
    "m/s": "ft/s",
    "rad": "deg",
    "rad/s": "deg/s",
    "kg^0.5 m": "slug^0.5 ft",
    "kg^0.5 m/s": "slug^0.5 ft/s",
    "N": "lbf",
    "N m": "lbf ft",
    "Pa": "lbf/ft^2",
    "m s": "ft s",
}
"""The unit in which the paper (or the literature it cites) prints a quantity of an SI unit of ours."""


@cache
def registry() -> pint.UnitRegistry:
    """Return the one unit registry (built on first use: it takes a noticeable fraction of a second)."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=False)


def rounded(value: float) -> float:
    """Return ``value`` to 15 digits: what was written, without the last-digit error of a conversion or a sum."""
    return float(f"{value:.15g}")


@cache
def factor(unit: str, to: str) -> float:
    """Return the number that turns a value in ``unit`` into one in ``to``; both multiplicative."""
    return float(registry().Quantity(1.0, unit).to(to).magnitude)


def to_paper(value: float, unit: str) -> tuple[float, str]:
    """Return ``value``, given in the SI ``unit``, in the paper's unit, and the name of that unit."""
    paper = PAPER_UNITS.get(unit, unit)
    return (value * factor(unit, paper) if paper != unit else value), paper


def parse_quantity(text: object, unit: str, field: str) -> float:
    """Return the quantity written in ``text`` as a number in ``unit``.

    Args:
        text: What the user wrote, e.g. ``"85500 ft"``. A bare number is accepted only where ``unit`` is ``"1"``.
        unit: Target unit, e.g. ``"m"``.
        field: Name used in the error message.

    Raises:
        QuantityError: The text cannot be read, its unit has another dimension, or the value is not finite. Angles are
            no bare numbers, nor frequencies angular frequencies: "15 Hz" is refused where rad/s are due.
    """
    import math

    import pint

    expected = f"expected a finite quantity such as {_EXAMPLES.get(unit, f'1.0 {unit}')!r}"
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise QuantityError(f"{field} = {text!r}: {expected}")
    if not isinstance(text, str) and unit != "1":
        raise QuantityError(f"{field} = {text!r}: the unit is missing, {expected}")
    if isinstance(text, str) and not any(map(str.isdigit, text)):
        raise QuantityError(f"{field} = {text!r}: no number, {expected}")
    try:
        quantity: Any = registry().Quantity(str(text).replace("%", " percent"))
        if quantity.to_root_units().units != _root_units(unit):
            raise QuantityError(
                f"{field} = {text!r}: {'the unit is missing' if _bare(text) else 'wrong unit'}, {expected}"
            )
        value = rounded(float(quantity.to(unit).magnitude))
    except QuantityError:
        raise
    except pint.UndefinedUnitError as error:
        raise QuantityError(f"{field} = {text!r}: unknown unit, {expected}") from error
    except Exception as error:  # pint lets the errors of Python's tokenizer and of its operators through
        raise QuantityError(f"{field} = {text!r}: cannot be read, {expected}") from error
    if not math.isfinite(value):
        raise QuantityError(f"{field} = {text!r}: {expected}")
    return value


def _bare(text: object) -> bool:
    try:
        float(str(text))
    except ValueError:
        return False
    return True


@cache
def _root_units(unit: str) -> object:
    return registry().Quantity(1.0, unit).to_root_units().units


_EXAMPLES = {"m": "85500 ft", "m/s": "7900 ft/s", "rad": "0.3 deg", "s": "200 s", "1": "+10 %", "rad/s": "15 rad/s"}
