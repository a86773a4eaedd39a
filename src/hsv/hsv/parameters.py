"""Parameters of the components: one table a component, from which nodes declare and files are checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from hsv.errors import ParameterError
from hsv.units import parse_quantity

Value = bool | int | float | str | list[float] | list[str] | list[int]


@dataclass(frozen=True)
class Parameter:
    """One parameter; its type is that of ``default``."""

    name: str
    """Dotted name, as in ROS 2."""
    default: Value
    """Value where nothing else is given; an empty list of floats stands for an array that a design must bring."""
    description: str
    """What it is, in a few words."""
    unit: str = ""
    """SI unit, empty where it has none."""
    minimum: float = -math.inf
    """Least admissible number (of every element)."""
    maximum: float = math.inf
    """Largest admissible number (of every element)."""
    choices: tuple[str, ...] = ()
    """Admissible words; empty: any."""
    read_only: bool = True
    """Whether it is fixed once the node has started."""

    @property
    def kind(self) -> str:
        """Name of the ROS 2 parameter type, e.g. ``double_array``."""
        if isinstance(self.default, list):
            return "string_array" if self.default and isinstance(self.default[0], str) else "double_array"
        return {bool: "bool", int: "integer", float: "double", str: "string"}[type(self.default)]

    @property
    def constraint(self) -> str:
        """What a value must satisfy, in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        low, high = self.minimum, self.maximum
        words = {
            (False, False): "",
            (True, False): f" of at least {low:.10g}",
            (False, True): f" of at most {high:.10g}",
            (True, True): f" from {low:.10g} to {high:.10g}",
        }[(math.isfinite(low), math.isfinite(high))]
        if self.kind == "double_array":
            words = words or " of finite numbers"
        return f"{self.kind.replace('_', ' ')}{words}{' ' + self.unit if self.unit else ''}"

    def check(self, value: object) -> Any:
        """Return ``value`` if it is admissible.

        Raises:
            ParameterError: Wrong type (an integer is not a double), not finite, outside the range or the choices.
        """
        if self.kind.endswith("_array"):
            if not isinstance(value, list | tuple) and not hasattr(value, "tolist"):
                raise self.refusal(value)
            element = str if self.kind == "string_array" else float
            values = list(cast(Iterable[Any], value))
            for index, entry in enumerate(values):
                if not isinstance(entry, element) or (element is float and not self._in_range(entry)):
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
        elif not isinstance(value, bool) and not self._in_range(value):
            raise self.refusal(value)
        return value

    def refusal(self, value: object) -> ParameterError:
        """Return the error that tells why ``value`` is not admissible, and what to write for a whole number."""
        hint = ""
        if self.kind == "double" and _is_whole(value):
            hint = f" (write {float(cast(int, value))})"
        elif self.kind == "double_array" and isinstance(value, Iterable) and not isinstance(value, str):
            values = list(value)
            if any(map(_is_whole, values)) and all(_is_whole(entry) or isinstance(entry, float) for entry in values):
                hint = f" (write {_shown([float(entry) for entry in values])})"
        shown = value.tolist() if hasattr(value, "tolist") else value
        return ParameterError(f"parameter {self.name} = {_shown(shown)}: expected {self.constraint}{hint}")

    def _in_range(self, value: object) -> bool:
        return isinstance(value, int | float) and math.isfinite(value) and self.minimum <= value <= self.maximum


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def check_all(table: Iterable[Parameter], values: Mapping[str, object]) -> dict[str, Any]:
    """Return the values of a whole table, defaults filled in; names that are not in the table are left out.

    Raises:
        ParameterError: A value that its parameter does not admit.
    """
    return {p.name: p.check(values.get(p.name, p.default)) for p in table}


def table_values(parameters: Iterable[Parameter], tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the flat values, SI, that ``tables``, as a file has them, give to the ``parameters`` named after them.

    One value stands for a list of it.

    Raises:
        ParameterError, QuantityError: A table, key or value that is not admitted, named.
    """
    known = {parameter.name: parameter for parameter in parameters}
    values: dict[str, Any] = {}
    for name, entries in tables.items():
        if isinstance(entries, Mapping):
            values |= table_values(known.values(), {f"{name}.{key}": entry for key, entry in entries.items()})
            continue
        if name not in known:
            near = [other for other in known if other.rpartition(".")[0] == name.rpartition(".")[0]] or known
            raise ParameterError(f"{name}: unknown key, expected one of {', '.join(near) or 'no table'}")
        parameter = known[name]
        listed = entries if isinstance(entries, list) else [entries]
        if parameter.kind.startswith("double"):
            listed = [parse_quantity(entry, parameter.unit or "1", name) for entry in listed]
        several = parameter.kind.endswith("_array") or isinstance(entries, list)
        values[name] = parameter.check(listed if several else listed[0])
    return values
