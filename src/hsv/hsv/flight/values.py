"""Values of a scenario's file that no fixed table has: numbers, or the distributions in their place.

A distribution is read as its mean, and noted by the identity of the table that it is written in.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hsv.base.errors import ParameterError, ScenarioError, did_you_mean
from hsv.base.parameters import Parameter, limits_in_words, read_number
from hsv.base.units import si_unit_of, written
from hsv.flight.distribution import Distribution, read_distribution
from hsv.flight.tables import FaultTable
from hsv.model.faults.table import fault_parameters


def tables_in(value: object, field: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield every table in ``value``, with its place as a field is called."""
    if isinstance(value, dict):
        yield field, value
        for key, entry in value.items():
            yield from tables_in(entry, f"{field}.{key}" if field else key)
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from tables_in(entry, f"{field}[{index}]")


def number(found: dict[int, Distribution], parameter: Parameter, value: object, field: str) -> float:
    """Return a number in a file, or the mean of a distribution in its place, which goes to ``found``.

    Raises:
        ScenarioError, ParameterError, QuantityError: None that the ``parameter`` admits.
    """
    if not isinstance(value, dict):
        return read_number(parameter, value, field)
    drawn = found[id(value)] = read_distribution(value, parameter.unit or "1", field, whole=parameter.whole)
    if not parameter.minimum <= drawn.low < drawn.high <= parameter.maximum:
        limits = limits_in_words(parameter, next(iter(value.values()))[0])
        raise ScenarioError(f"{field} = {value!r}: expected all values{limits}")
    return drawn.middle


def own_value(field: str, value: object, found: dict[int, Distribution]) -> Any:
    """Return an entry of a controller's own table with means in the place of distributions, which go to ``found``.

    Which unit is due only the controller's class knows: it is taken from their first value.
    """
    if isinstance(value, list):
        return [own_value(field, entry, found) for entry in value]
    if not isinstance(value, dict):
        return value
    pair = next(iter(value.values()), None)
    first = pair[0] if isinstance(pair, list) and pair else None
    drawn = found[id(value)] = read_distribution(value, si_unit_of(first), field)
    return written(drawn.middle, drawn.unit)


def fault_tables(rows: object, found: dict[int, Distribution]) -> object:
    """Return the faults in a file as :class:`FaultTable` has them; distributions in them go to ``found``.

    Raises:
        ScenarioError, QuantityError: Names the field that is wrong.
    """
    if not isinstance(rows, list | tuple):
        return rows
    return [_fault_row(f"fault[{i}]", row, found) if isinstance(row, dict) else row for i, row in enumerate(rows)]


def _fault_row(field: str, row: dict[str, Any], found: dict[int, Distribution]) -> dict[str, Any]:
    common = {key: row[key] for key in FaultTable.model_fields if key in row and key != "parameters"}
    channel, kind = (row.get(key) for key in ("channel", "type"))
    if not (isinstance(channel, str) and isinstance(kind, str)):
        return common  # which is refused
    try:
        table = {parameter.name: parameter.of(channel) for parameter in fault_parameters(channel, kind)}
    except ParameterError as error:
        raise ScenarioError(str(error).replace("fault.", f"{field}.", 1)) from error
    parameters = {}
    for key, value in row.items():
        if key in common:
            continue
        if key not in table:
            expected = (*table, *(name for name in FaultTable.model_fields if name != "parameters"))
            raise ScenarioError(
                f"{field}.{key}: unknown key, expected one of {', '.join(expected)}{did_you_mean(key, expected)}"
            )
        parameters[key] = number(found, table[key], value, f"{field}.{key}")
    return {**common, "parameters": parameters}
