"""The curves of the live page as columns of numbers, by the panels of the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from hsv.bags.description import STATE, TUBE_STATUS
from hsv.pages.panels import ERRORS, PANELS, Curve, Kind, Panel, error_panel

Read = Callable[[Any], float]
"""Function that returns a number from a message."""


@dataclass(frozen=True)
class Column:
    """A curve of a panel, with the function that reads its value from a message of its topic."""

    panel: Panel
    kind: Kind
    label: str
    topic: str
    read: Read


def columns() -> list[Column]:
    """Return all columns except the time, grouped by panel."""
    found = [column for panel in PANELS for column in _curves(panel)]
    for component in range(len(ERRORS)):
        panel = error_panel(component)
        found += _curves(panel)
        for sign, label in ((-1.0, "c − z"), (1.0, "c + z")):
            found.append(Column(panel, Kind.bound, label, TUBE_STATUS, _edge(component, sign)))
    return found


def row(columns: Sequence[Column], messages: Mapping[str, Any]) -> np.ndarray:
    """Return time (s) and the values of all columns (1 + columns); NaN if a topic has no message.

    Args:
        columns: Columns to read.
        messages: Messages of one step by topic, including the state.
    """
    stamp = messages[STATE].header.stamp
    values = [stamp.sec + 1e-9 * stamp.nanosec]
    values += [column.read(messages[column.topic]) if column.topic in messages else np.nan for column in columns]
    return np.array(values)


def _curves(panel: Panel) -> list[Column]:
    return [Column(panel, curve.kind, curve.label, curve.topic, _reader(curve)) for curve in panel.curves]


def _reader(curve: Curve) -> Read:
    parts = [attrgetter(path) for path in curve.fields]
    index = curve.column

    def read(message: Any) -> float:
        values = [part(message) for part in parts]
        return float(sum(values if index is None else [_element(value, index) for value in values]))

    return read


def _edge(component: int, sign: float) -> Read:
    def read(message: Any) -> float:
        return _element(message.tube_centre, component) + sign * _element(message.tube_half_width, component)

    return read


def _element(values: Sequence[float], index: int) -> float:
    return float(values[index]) if index < len(values) else np.nan
