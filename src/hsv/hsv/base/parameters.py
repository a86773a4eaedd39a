"""Parameters: each component has one table of its parameters, with which nodes declare them and files are checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from hsv.base.errors import Mistakes, ParameterError, did_you_mean, one_of
from hsv.base.units import in_unit_of, is_finite, parse_quantity

Value = bool | int | float | str | list[float] | list[str] | list[int]


@dataclass(frozen=True)
class Parameter:
    """One parameter; its type is that of ``default``."""

    name: str
    """Dotted name, as in ROS 2."""
    default: Value
    """Default value; an empty list stands for an array of doubles that has no default."""
    description: str
    """Short description."""
    unit: str = ""
    """SI unit; empty for a dimensionless parameter."""
    minimum: float = -math.inf
    """Smallest admissible value of a number, or of each element of an array."""
    maximum: float = math.inf
    """Largest admissible value of a number, or of each element of an array."""
    choices: tuple[str, ...] = ()
    """Admissible texts; if empty, any text."""
    read_only: bool = True
    """Whether the value is fixed once the node has started."""
    whole: bool = False
    """Whether a double must be integer-valued, such as a number of steps."""
    needs: str = ""
    """Name of another parameter that a file must set too, because this one has no effect without it."""

    @property
    def kind(self) -> str:
        """Name of the ROS 2 parameter type, e.g. ``double_array``."""
        if isinstance(self.default, list):
            return "string_array" if self.default and isinstance(self.default[0], str) else "double_array"
        return {bool: "bool", int: "integer", float: "double", str: "string"}[type(self.default)]

    @property
    def constraint(self) -> str:
        """Condition for a valid value, in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        words = _range(self.minimum, self.maximum)
        if self.kind == "double_array":
            words = words or " of finite numbers"
        whole = ", whole" if self.whole else ""
        return f"{self.kind.replace('_', ' ')}{words}{' ' + self.unit if self.unit else ''}{whole}"

    def check(self, value: object) -> Any:
        """Return ``value`` if it is admissible; an array is returned as a list.

        Raises:
            ParameterError: The type is wrong (an integer is not a double), or the value is not finite, not
                integer-valued where that is required, outside the range or not one of the choices.
        """
        if self.kind.endswith("_array"):
            if not isinstance(value, list | tuple) and not hasattr(value, "tolist"):
                raise self.refusal(value)
            element = str if self.kind == "string_array" else float
            values = list(cast(Iterable[Any], value))
            for index, entry in enumerate(values):
                if not isinstance(entry, element) or (element is float and not self.admits(entry)):
                    raise ParameterError(
                        f"parameter {self.name}[{index}] = {_shown(entry)}: expected {self.constraint}"
                    )
            return values
        expected = {"bool": bool, "integer": int, "double": float, "string": str}[self.kind]
        if not isinstance(value, expected) or (expected is int and isinstance(value, bool)):
            raise self.refusal(value)
        if isinstance(value, str):
            if self.choices and value not in self.choices:
                raise self.refusal(value)
        elif not isinstance(value, bool) and not self.admits(value):
            raise self.refusal(value)
        return value

    def refusal(self, value: object) -> ParameterError:
        """Return the error for an invalid ``value``; for an integer in place of a double, it gives the correct form."""
        hint = ""
        if self.kind == "double" and _is_whole(value):
            hint = f" (write {float(cast(int, value))})"
        elif self.kind == "double_array" and isinstance(value, Iterable) and not isinstance(value, str):
            values = list(value)
            if any(map(_is_whole, values)) and all(_is_whole(entry) or isinstance(entry, float) for entry in values):
                hint = f" (write {_shown([float(entry) for entry in values])})"
        shown = value.tolist() if hasattr(value, "tolist") else value
        return ParameterError(f"parameter {self.name} = {_shown(shown)}: expected {self.constraint}{hint}")

    def admits(self, value: object) -> bool:
        """Return whether ``value`` is a finite number within the range, and integer-valued if that is required."""
        if not isinstance(value, int | float) or not is_finite(value):
            return False
        return self.minimum <= value <= self.maximum and (not self.whole or float(value).is_integer())


def _range(low: float, high: float) -> str:
    return {
        (False, False): "",
        (True, False): f" of at least {low:.10g}",
        (False, True): f" of at most {high:.10g}",
        (True, True): f" from {low:.10g} to {high:.10g}",
    }[(math.isfinite(low), math.isfinite(high))]


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and is_finite(value)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def validate(table: Iterable[Parameter], values: Mapping[str, object]) -> dict[str, Any]:
    """Return the value of every parameter in ``table`` by name, or its default; other names in ``values`` are ignored.

    Raises:
        ParameterError: A value is not admissible.
    """
    return {p.name: p.check(values.get(p.name, p.default)) for p in table}


def one_or(name: str, given: list[float], standard: float) -> float:
    """Return the only value in ``given``, the array of the parameter ``name``, or ``standard`` if it is empty.

    Raises:
        ParameterError: ``given`` has several values.
    """
    if len(given) > 1:
        raise ParameterError(f"parameter {name}: {len(given)} values, expected one, or none for the set's")
    return float(given[0]) if given else standard


def check_lengths(values: Mapping[str, Any], first: str, *others: str) -> None:
    """Raise a ParameterError unless the arrays named ``others`` have as many values as the array named ``first``."""
    for name in others:
        if len(values[name]) != len(values[first]):
            raise ParameterError(
                f"parameter {name}: {len(values[name])} values, expected as many as {first}, {len(values[first])}"
            )


def read_number(parameter: Parameter, text: object, field: str) -> float:
    """Return the number (SI) that a file gives as ``text`` for a ``parameter`` or for one of its elements.

    Raises:
        ParameterError, QuantityError: The text is not a quantity of the right dimension, or the number is out of range
            or not integer-valued where that is required. The message states the range in the unit of the text.
    """
    whole = " a whole number" if parameter.whole else ""
    # In Python a bool is an int.
    value = math.nan if whole and isinstance(text, bool) else parse_quantity(text, parameter.unit or "1", field)
    if not parameter.admits(value):
        raise ParameterError(f"{field} = {_shown(text)}: expected{whole}{limits_in_words(parameter, text)}")
    return value


def limits_in_words(parameter: Parameter, text: object) -> str:
    """Return a ``parameter``'s range in the unit of ``text``, such as " of at least 2 m"; if it has none, " m"."""
    ends, unit = in_unit_of((parameter.minimum, parameter.maximum), parameter.unit or "1", text)
    return _range(*ends) + unit


def table_values(
    parameters: Iterable[Parameter], tables: Mapping[str, Any], read: Callable[..., float] = read_number
) -> dict[str, Any]:
    """Return the values (SI) that the ``tables`` of a file set, by the dotted names of their ``parameters``.

    For an array of one element, the element alone is accepted as well.

    Args:
        parameters: Known parameters.
        tables: Nested tables; their keys, joined by dots, are names of parameters.
        read: Function that reads a number; it has the arguments of :func:`read_number`.

    Raises:
        ParameterError, QuantityError: A table, key or value is not admissible, and the message names it; or a parameter
            is set without the one that it needs. Further mistakes are notes of the error.
    """
    known = {parameter.name: parameter for parameter in parameters}
    mistakes = Mistakes()
    values = _flat_values(known, tables, read, mistakes)
    mistakes.report()
    for name in values:
        if (needed := known[name].needs) and needed not in values:
            raise ParameterError(f"{name}: has no effect without {needed}, expected both")
    return values


def _flat_values(
    known: Mapping[str, Parameter], tables: Mapping[str, Any], read: Callable[..., float], mistakes: Mistakes
) -> dict[str, Any]:
    """Return the values in nested ``tables`` by the names of the ``known`` parameters, see :func:`table_values`."""
    values: dict[str, Any] = {}
    for name, entry in tables.items():
        with mistakes:
            parameter = known.get(name)
            if parameter is None:
                entries = _entries_of(name, entry, known)
                values |= _flat_values(known, {f"{name}.{key}": entries[key] for key in entries}, read, mistakes)
            else:
                values[name] = _parameter_value(parameter, name, entry, read)
    return values


def _parameter_value(parameter: Parameter, name: str, entry: object, read: Callable[..., float]) -> Any:
    """Return the value (SI) of a ``parameter`` that a file gives as ``entry``, see :func:`table_values`."""
    if not parameter.kind.startswith("double"):
        several = parameter.kind.endswith("_array") and not isinstance(entry, list)
        try:
            return parameter.check([entry] if several else entry)
        except ParameterError as error:
            hint = did_you_mean(entry, parameter.choices) if isinstance(entry, str) else ""
            raise ParameterError(str(error).removeprefix("parameter ") + hint) from error
    if not isinstance(entry, list):
        number = read(parameter, entry, name)
        return [number] if parameter.kind == "double_array" else number
    if parameter.kind == "double":
        raise ParameterError(f"{name} = {_shown(entry)}: expected one value, not a list")
    if not entry:
        raise ParameterError(f"{name} = []: expected one value at least")
    return [read(parameter, number, f"{name}[{i}]") for i, number in enumerate(entry)]


def _entries_of(name: str, entry: object, known: Iterable[str]) -> Mapping[str, Any]:
    """Return the ``entry`` of the key ``name`` if it must be a table and is one; else raise a ParameterError."""
    depth = name.count(".") + 1
    within, _, own = name.rpartition(".")
    inside = [other.split(".")[depth] for other in known if other.startswith(f"{name}.")]
    if inside and isinstance(entry, Mapping):
        return entry
    if inside:
        raise ParameterError(f"{name} = {_shown(entry)}: expected a table of {', '.join(dict.fromkeys(inside))}")
    siblings = [other.split(".")[depth - 1] for other in known if other.startswith(f"{within}." if within else "")]
    raise ParameterError(f"{name}: unknown key, expected {one_of(dict.fromkeys(siblings) or ['no table'], own)}")
