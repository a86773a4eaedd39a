"""Parameters and certificates made readable: a tree of quantities, words, tables and sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hsv.base.parameters import Parameter

_STATES = ("h", "V", "α", "θ", "q", "η₁", "η̇₁", "η₂", "η̇₂")
_INPUTS = ("Φ", "δe")
_NUMBERS_IN_A_ROW = 9

_MATRICES = {
    "model.a": (9, _STATES),
    "model.b": (9, _INPUTS),
    "feedback.gain": (2, _STATES),
    "nominal.gains": (2, _STATES),
    "nominal.ellipsoids": (5, _STATES[:5]),
}
"""Height and columns of the matrices that a design holds one after the other, row by row."""


@dataclass(frozen=True)
class Quantity:
    """A number with its SI unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class Table:
    """Numbers in rows, as long as they are; every ``height`` rows are a matrix, ``headings`` name the columns."""

    rows: tuple[tuple[float, ...], ...]
    height: int = 0
    headings: tuple[str, ...] = ()

    @property
    def size(self) -> str:
        """Size of the table in words."""
        width = len(self.rows[0]) if self.rows else 0
        if self.height:
            count = len(self.rows) // self.height
            return f"{f'{count} matrices ' if count > 1 else ''}{self.height} × {width}"
        return f"{sum(map(len, self.rows))} numbers"


@dataclass(frozen=True)
class Section:
    """Named values."""

    entries: tuple[tuple[str, Value], ...]


Value = Quantity | Table | Section | str


def parameters(values: Mapping[str, Any], declared: Mapping[str, Parameter]) -> dict[str, Value]:
    """Return flat parameters, each with the unit it is declared with, those of a design as matrices."""
    return {name: _parameter(name, value, values, declared) for name, value in values.items()}


def tree(value: Any, unit: str = "") -> Value:
    """Return plain data, as in JSON and YAML, as a tree; booleans and missing values become words."""
    match value:
        case None:
            return "none"
        case bool():
            return "yes" if value else "no"
        case int() | float():
            return Quantity(value, unit)
        case Mapping():
            return Section(tuple((str(key), tree(entry)) for key, entry in value.items()))
        case list() | tuple():
            return _sequence(value, unit)
    return str(value)


def _parameter(name: str, value: Any, values: Mapping[str, Any], declared: Mapping[str, Parameter]) -> Value:
    if not isinstance(value, list) or not value or not _numbers(value):
        return tree(value, declared[name].unit if name in declared else "")
    if name in _MATRICES:
        height, headings = _MATRICES[name]
        return _table(value, len(headings), height, headings)
    if name == "tube.shape":
        size = round(len(value) ** 0.5)
        return _table(value, size, size)
    points = values.get(name.replace(".weights", ".breakpoints"))
    if name.endswith(".weights") and points:
        return _table(value, len(value) // len(points), len(points))
    return _sequence(value, declared[name].unit if name in declared else "")


def _sequence(value: Sequence[Any], unit: str) -> Value:
    if _numbers(value):
        return Quantity(value[0], unit) if len(value) == 1 else _table(value, _NUMBERS_IN_A_ROW)
    if all(isinstance(entry, str) for entry in value):
        return ", ".join(value)
    if all(isinstance(row, list) and _numbers(row) for row in value):
        return Table(tuple(tuple(map(float, row)) for row in value), len(value))
    return Section(tuple((str(number), tree(entry)) for number, entry in enumerate(value, 1)))


def _table(numbers: Sequence[float], width: int, height: int = 0, headings: tuple[str, ...] = ()) -> Table:
    rows = (tuple(map(float, numbers[first : first + width])) for first in range(0, len(numbers), width))
    return Table(tuple(rows), height, headings)


def _numbers(value: Sequence[Any]) -> bool:
    return all(isinstance(entry, int | float) and not isinstance(entry, bool) for entry in value)
