"""Conversion between quantities with units, as people write them, and the SI numbers used inside the library.

Reading a quantity rounds once: its number is read, and factors are multiplied, as fractions. Constants therefore have
the same bits on every machine and with every version of pint, the units library.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from hsv.base.errors import QuantityError, one_of

if TYPE_CHECKING:
    import pint

FOOT = 0.3048
"""Metres in a foot, by definition."""

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
"""For each SI unit, the unit in which the paper (or the literature that it cites) prints such a quantity."""

METRIC_UNITS = {"rad": "deg"}
"""For each SI unit that people rarely read, the metric unit that is shown instead."""


class UnitSystem(StrEnum):
    """Systems of units in which values are printed and plotted."""

    metric = "metric"
    """SI, but angles in degrees and shares in percent"""
    si = "si"
    paper = "paper"
    """Feet, pounds, slugs, degrees and percent"""


_EXAMPLES = {"m": "85500 ft", "m/s": "7900 ft/s", "rad": "0.3 deg", "s": "200 s", "1": "+10 %", "rad/s": "15 rad/s"}

_TERM = r"([^\W\d]\w*|[%°])(\s*(\^|\*\*)\s*-?[0-9](\.[0-9]+)?)?"
_QUANTITY = re.compile(
    r"(?P<number>(?>[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]{1,4})?))"
    rf"\s*(?P<unit>(1?\s*/\s*)?{_TERM}(\s*[*/ ]\s*{_TERM})*)?",
    re.IGNORECASE,
)
"""A decimal number and, optionally, a product or quotient of units with exponents below 10."""

_ROOT_BITS = 80
"""Bits to which a square root is computed before it is rounded to the 53 bits of a double."""


@cache
def registry() -> pint.UnitRegistry:
    """Return the registry of pint, with fractions as factors; it is slow to create, and only rare units need it."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=False, non_int_type=Fraction)


def is_finite(value: float) -> bool:
    """Return whether ``value`` is finite and within the range of a double, which an integer may exceed."""
    return abs(value) <= sys.float_info.max


def rounded(value: float) -> float:
    """Return ``value`` rounded to 15 significant digits, which removes the rounding error of a sum or product."""
    return float(f"{value:.15g}")


@cache
def factor(unit: str, to: str) -> float:
    """Return the factor that converts a value in ``unit`` into one in ``to``, a unit of the same dimension."""
    return _scaled(Fraction(1), _squared_ratio(unit, to)[0])


def unit_system(name: str) -> UnitSystem:
    """Return the unit system called ``name``.

    Raises:
        QuantityError: There is no such system.
    """
    if name not in [*UnitSystem]:
        raise QuantityError(f"units = {name!r}: expected {one_of(UnitSystem, name)}")
    return UnitSystem(name)


def unit_in(system: UnitSystem, unit: str) -> str:
    """Return the unit that ``system`` shows for the SI ``unit``; a quotient not in its table keeps its SI divisor."""
    if system is UnitSystem.si:
        return unit
    own = PAPER_UNITS if system is UnitSystem.paper else METRIC_UNITS
    dividend, slash, divisor = unit.rpartition("/")
    return own.get(unit) or (f"{unit_in(system, dividend)}/{divisor}" if slash else unit)


def in_system(value: float, unit: str, system: UnitSystem, *, share: bool = False) -> tuple[float, str]:
    """Return ``value``, given in the SI ``unit``, in the unit of ``system``, and the name of that unit.

    Args:
        value: The number.
        unit: Its SI unit.
        system: Unit system of the result.
        share: Whether the value is a share (0 to 1), shown in percent except in strict SI.
    """
    if share and system is not UnitSystem.si:
        return 100.0 * value, "%"
    other = unit_in(system, unit)
    return (value * factor(unit, other) if other != unit else value), other


def to_paper(value: float, unit: str) -> tuple[float, str]:
    """Return ``value``, given in the SI ``unit``, in the paper's unit, and the name of that unit."""
    return in_system(value, unit, UnitSystem.paper)


def readable(value: float, unit: str, system: UnitSystem = UnitSystem.metric) -> str:
    """Return ``value``, given in the SI ``unit``, as text with up to 10 digits and its unit in ``system``."""
    number, shown = in_system(value, unit, system)
    return f"{number:.10g}" + ("" if shown == "1" else f" {shown}")


def significant(value: float, digits: int = 3) -> str:
    """Return ``value`` as text with ``digits`` significant digits; a longer integer part, up to 6 digits, is kept."""
    return f"{value:.0f}" if float(f"1e{digits - 1}") <= abs(value) < 999999.5 else f"{value:.{digits}g}"


def quantity_text(value: float, unit: str, system: UnitSystem) -> str:
    """Return ``value``, given in the SI ``unit``, as text (:func:`significant`) with its unit in ``system``."""
    number, name = in_system(value, unit, system)
    return significant(number) + ("" if name in ("", "1") else f" {name}")


def duration_in_words(seconds: float) -> str:
    """Return a wall time as people read it: ``40 s``, ``12 min`` or ``2 h 5 min``."""
    hours, minutes = divmod(round(seconds / 60.0), 60)
    if minutes < 2 and not hours:
        return f"{significant(seconds, 2)} s"
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def si_unit_of(text: object) -> str:
    """Return the SI base units of the quantity ``text``, or ``"1"`` if it has no known unit or is not a quantity."""
    try:
        base = _squared(_number_and_unit(text)[1] if isinstance(text, str) else "")[1]
    except ValueError:
        return "1"
    factors, divisors = (
        [name + (f"^{abs(power) / 2:g}" if abs(power) != 2 else "") for name, power in base if sign * power > 0]
        for sign in (1, -1)
    )
    return "/".join((" ".join(factors) or "1", *divisors))


def base_units(unit: str) -> dict[str, float]:
    """Return the exponents of the SI base units in ``unit``: of ``"N"``, 1 for kg, 1 for m and -2 for s."""
    return {name: power / 2 for name, power in _squared(unit)[1]}


def written(value: float, unit: str) -> float | str:
    """Return ``value`` for a file: a text with its ``unit``, or the number if ``unit`` is ``"1"``; no bit is lost."""
    return value if unit == "1" else f"{value!r} {unit}"


def percent(share: float) -> str:
    """Return a ``share`` (0 to 1) as text in percent for a file, without loss of digits."""
    return f"{Decimal(repr(share)).scaleb(2).normalize():f} %"


def has_unit(text: object) -> bool:
    """Return whether ``text`` is a quantity that is written with a unit."""
    found = _QUANTITY.fullmatch(text.strip()) if isinstance(text, str) else None
    return bool(found and found["unit"])


def in_unit_of(values: Sequence[float], unit: str, text: object) -> tuple[list[float], str]:
    """Return ``values``, given in the SI ``unit``, in the unit of the quantity ``text``.

    The second result is the name of that unit after a space. If ``text`` has no unit, the values stay in the SI
    ``unit``, whose name is then the second result, empty for ``"1"``.
    """
    found = _QUANTITY.fullmatch(text.strip()) if isinstance(text, str) else None
    own = (found["unit"] or "") if found else ""
    if not own:
        return list(values), "" if unit == "1" else f" {unit}"
    written_out = re.sub(r"\s*([*/])\s*", r"\1", f"1{own}" if own.startswith("/") else own)  # "/ s" is 1/s
    scale = factor(unit, written_out.replace("%", "percent"))
    return [value * scale for value in values], f" {own}"


def parse_quantity(text: object, unit: str, field: str) -> float:
    """Return the quantity written in ``text`` as a number in ``unit``.

    Args:
        text: Text of the user, e.g. ``"85500 ft"``. A bare number is accepted only where ``unit`` is ``"1"``.
        unit: Target unit, e.g. ``"m"``.
        field: Name used in the error message.

    Raises:
        QuantityError: The text cannot be read, its unit has another dimension, or the value is not finite. Radians
            count as a dimension: an angle needs its unit. Where rad/s are expected, "15 Hz" means 15 cycles a second.
    """
    expected = f"expected a finite quantity such as {_EXAMPLES.get(unit, f'1.0 {unit}')!r}"
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise QuantityError(f"{field} = {text!r}: {expected}")
    if not isinstance(text, str):
        if unit != "1":
            raise QuantityError(f"{field} = {text!r}: the unit is missing, {expected}")
        if not is_finite(text):
            raise QuantityError(f"{field} = {text!r}: {expected}")
        return float(text)
    if not any(map(str.isdigit, text)):
        raise QuantityError(f"{field} = {text!r}: no number, {expected}")
    try:
        value = _converted(text, unit)
        if value is None:
            problem = "wrong unit" if _number_and_unit(text)[1] else "the unit is missing"
            raise QuantityError(f"{field} = {text!r}: {problem}, {expected}")
        return value
    except QuantityError:
        raise
    except OverflowError as error:
        raise QuantityError(f"{field} = {text!r}: {expected}") from error
    except _UnknownUnitError as error:
        raise QuantityError(f"{field} = {text!r}: unknown unit, {expected}") from error
    except Exception as error:  # pint lets the errors of Python's tokenizer and of its operators through
        raise QuantityError(f"{field} = {text!r}: cannot be read, {expected}") from error


@lru_cache(maxsize=4096)
def _converted(text: str, unit: str) -> float | None:
    """Return the quantity ``text`` in ``unit``, or ``None`` if the dimensions differ; cached for campaigns."""
    number, written = _number_and_unit(text)
    square, dimension = _squared_ratio(written, unit)
    return None if dimension else _scaled(number, square)


def _squared_ratio(unit: str, to: str) -> Square:
    """Return the square of ``unit`` over that of ``to``; the dimension is empty if one can be converted to the other.

    A number of Hz is one of cycles, of 2 pi rad each, where the other unit is one of an angular frequency.
    """
    (square, dimension), (other_square, other) = _squared(unit), _squared(to)
    for name, own, opposite, sign in ((unit, dimension, other, 1), (to, other, dimension, -1)):
        if name.endswith("Hz") and opposite == (("rad", 2), *own):
            return square / other_square * (2 * _PI) ** (2 * sign), ()
    return square / other_square, () if dimension == other else (*dimension, *other)


def _number_and_unit(text: str) -> tuple[Fraction, str]:
    found = _QUANTITY.fullmatch(text.strip())
    if not found:
        raise ValueError(f"{text!r}: expected a number and a unit")
    unit = re.sub(r"\s*([*/^ ])\s*", r"\1", found["unit"] or "").replace("%", "percent")
    return Fraction(found["number"]), f"1{unit}" if unit.startswith("/") else unit


class _UnknownUnitError(ValueError):
    """A unit that neither this module nor pint knows."""


Square = tuple[Fraction, tuple[tuple[str, int], ...]]
"""The square of a unit: its factor in SI base units, and the symbol and exponent of each base unit.

The literature gives elastic modes in roots of a mass, such as kg^0.5 m. The squares of such units have integer
exponents.
"""


_PI = Fraction("3.1415926535897932384626433832795028841971693993751")
_FORCE, _PRESSURE = {"kg": 2, "m": 2, "s": -4}, {"kg": 2, "m": -2, "s": -4}
_KNOWN: dict[str, tuple[Fraction, dict[str, int]]] = {
    **{unit: (Fraction(size) ** 2, {"m": 2}) for unit, size in {"m": "1", "km": "1000", "mm": "1/1000"}.items()},
    **{unit: (Fraction(size) ** 2, {"m": 2}) for unit, size in {"ft": "0.3048", "kft": "304.8"}.items()},
    **{
        unit: (Fraction(size) ** 2, {"s": 2})
        for unit, size in {"s": "1", "ms": "1/1000", "min": "60", "h": "3600"}.items()
    },
    **{unit: (size**2, {"rad": 2}) for unit, size in {"deg": _PI / 180, "arcsec": _PI / 648000}.items()},
    **{unit: (Fraction(size) ** 2, {"rad": 2}) for unit, size in {"rad": "1", "mrad": "1/1000"}.items()},
    "": (Fraction(1), {}),
    "1": (Fraction(1), {}),
    "percent": (Fraction(1, 10**4), {}),
    "Hz": (Fraction(1), {"s": -2}),
    "rpm": ((_PI / 30) ** 2, {"rad": 2, "s": -2}),
    "kg": (Fraction(1), {"kg": 2}),
    "kg^0.5": (Fraction(1), {"kg": 1}),
    "N": (Fraction(1), _FORCE),
    "kN": (Fraction(10**6), _FORCE),
    "Pa": (Fraction(1), _PRESSURE),
    "kPa": (Fraction(10**6), _PRESSURE),
    # The values of pint, which rounds each of these units, and each product of them, to 16 digits.
    "slug": (Fraction("212.98200294060055"), {"kg": 2}),
    "slug ft^2": (Fraction("1.838242309017568"), {"kg": 2, "m": 4}),
    "slug/ft": (Fraction("2292.519200024031"), {"kg": 2, "m": -2}),
    "slug/ft^3": (Fraction("265615.3264483671"), {"kg": 2, "m": -6}),
    "slug^0.5 ft": (Fraction("1.3558179483314006"), {"kg": 1, "m": 2}),
    "lbf": (Fraction("19.78667553847073"), _FORCE),
    "lbf ft": (Fraction("1.838242309017568"), {"kg": 2, "m": 4, "s": -4}),
    "lbf/ft^2": (Fraction("2292.519200024031"), _PRESSURE),
    "lbf/slug^0.5": (Fraction("1.3558179483314006"), {"kg": 1, "m": 2, "s": -4}),
}
"""Squares of the units in the shipped files, because importing pint takes longer than a flight."""


@cache
def _squared(unit: str) -> Square:
    try:
        square, base = _composed(unit)
    except KeyError:
        return square_by_pint(unit)
    return square, tuple(sorted((name, exponent) for name, exponent in base.items() if exponent))


def _composed(unit: str) -> tuple[Fraction, dict[str, int]]:
    """Return factor and exponents of ``unit`` squared (see ``Square``); raise a KeyError if ``_KNOWN`` lacks a part."""
    if unit in _KNOWN:
        return _KNOWN[unit]
    if product := re.fullmatch(r"(.*)([*/ ])([^*/ ]+)", unit):
        (square, base), (other, more) = _composed(product[1]), _composed(product[3])
        sign = -1 if product[2] == "/" else 1
        exponents = {name: base.get(name, 0) + sign * more.get(name, 0) for name in {**base, **more}}
        return square * other**sign, exponents
    symbol, _, power = unit.partition("^")
    if not power.removeprefix("-").isdigit():
        raise KeyError(unit)
    square, base = _composed(symbol)
    return square ** int(power), {name: int(power) * exponent for name, exponent in base.items()}


def square_by_pint(unit: str) -> Square:
    """Return the square of ``unit``, see ``Square``, from the definitions of pint.

    Raises:
        ValueError: pint knows no such unit, or an exponent is not a multiple of one half.
    """
    import pint

    square = {}
    try:
        units = registry().parse_units("" if unit == "1" else unit)._units
    except pint.UndefinedUnitError as error:
        raise _UnknownUnitError(str(error)) from None
    for name, exponent in units.items():
        square[name] = round(2 * float(exponent))  # type: ignore[arg-type]
        if square[name] != 2 * exponent:
            raise ValueError(f"{unit!r}: expected exponents that are whole or halves")
    base = registry().Quantity(Fraction(1), pint.util.UnitsContainer(square)).to_base_units()
    exponents = {registry().get_symbol(name): int(exponent) for name, exponent in base._units.items()}  # type: ignore[arg-type]
    return Fraction(base.magnitude), tuple(sorted(exponents.items()))


def _scaled(number: Fraction, square: Fraction) -> float:
    """Return ``number`` times the square root of ``square``, rounded once."""
    if not number:
        return 0.0
    product = number * number * square
    # The root is computed as an integer of at least _ROOT_BITS bits. If digits are cut off, its last bit is set, so
    # that the final rounding goes to the correct side.
    shift = max(0, _ROOT_BITS - (product.numerator.bit_length() - product.denominator.bit_length()) // 2)
    whole, rest = divmod(product.numerator << 2 * shift, product.denominator)
    root = math.isqrt(whole)
    if rest or root * root != whole:
        root = root << 1 | 1
        shift += 1
    value = float(Fraction(root, 1 << shift))
    return -value if number < 0 else value
