"""Extraction of the arrays for the panels from a bag."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hsv.bags.description import STATE, TUBE_STATUS
from hsv.bags.equipment import effectors, equipment_topics, measurement_errors, moving_air
from hsv.bags.reader import Bag
from hsv.bags.steps import joined
from hsv.pages.report.panels import AIR_PANELS, MEASUREMENT_ERRORS, PANELS, Curve, Kind, Panel, error_panel


@dataclass(frozen=True)
class DrawnCurve:
    """A curve of one flight: y (n) over the flight's time, or over the two ends of it where y has two values."""

    kind: Kind
    label: str
    y: np.ndarray


@dataclass
class FlightCurves:
    """Time (n), in seconds, and the curves by panel; ``panels`` lists the panels this flight has, in order."""

    time: np.ndarray
    panels: list[Panel] = field(default_factory=list)
    curves: dict[str, list[DrawnCurve]] = field(default_factory=dict)


class _Source:
    """The columns of a bag's topics, of the steps that every topic has."""

    def __init__(self, bag: Bag) -> None:
        names = dict.fromkeys(curve.topic for panel in PANELS for curve in panel.curves)
        names |= dict.fromkeys(equipment_topics(bag))
        # A controller of one's own has no tube.
        self.columns = joined(bag, [name for name in names if name != TUBE_STATUS or name in bag.roles])
        self.time = self.columns[STATE]["header.stamp"] * 1e-9

    def values(self, curve: Curve) -> np.ndarray:
        columns = self.columns[curve.topic]
        parts = [columns[name] for name in curve.fields]
        return np.sum([part if curve.column is None else part[:, curve.column] for part in parts], axis=0)

    def tube(self, name: str) -> np.ndarray:
        """Return a vector field of the tube status, (n, components); components = 0 without a set."""
        if TUBE_STATUS not in self.columns:
            return np.empty((len(self.time), 0))
        return np.asarray(self.columns[TUBE_STATUS][name], float).reshape(len(self.time), -1)


def flight_curves(bag: Bag) -> FlightCurves:
    """Return everything that the panels of ``bag`` draw, SI.

    Raises:
        RecordingError: A topic is missing, or no step is complete.
    """
    source = _Source(bag)
    flight = FlightCurves(source.time)
    errors = [error_panel(component) for component in range(source.tube("error").shape[1])]
    for panel in (*PANELS, *errors):
        if any(curve.topic not in source.columns for curve in panel.curves):
            continue
        drawn = [DrawnCurve(curve.kind, curve.label, source.values(curve)) for curve in panel.curves]
        if np.isfinite(drawn[0].y).any():
            flight.panels.append(panel)
            flight.curves[panel.name] = drawn
    for name, were in effectors(source.columns).items():
        flight.curves[name].append(DrawnCurve(Kind.effector, "effector", were))
    for panels, found, label in (
        (MEASUREMENT_ERRORS, measurement_errors(source.columns), "measured less true"),
        (AIR_PANELS, moving_air(source.columns), "air"),
    ):
        for name, y in found.items():
            flight.panels.append(panels[name])
            flight.curves[panels[name].name] = [DrawnCurve(Kind.actual, label, y)]
    if "level" in flight.curves:
        flight.curves["level"].append(DrawnCurve(Kind.bound, "edge of the set", np.ones(2)))
    centre, half_width = source.tube("tube_centre"), source.tube("tube_half_width")
    for component in range(min(half_width.shape[1], len(errors))):
        c, z = centre[:, component], half_width[:, component]
        bounds = [DrawnCurve(Kind.bound, "c − z", _ends(c - z)), DrawnCurve(Kind.bound, "c + z", _ends(c + z))]
        flight.curves[errors[component].name] += bounds
    return flight


def _ends(y: np.ndarray) -> np.ndarray:
    return y[[0, -1]] if np.all(y == y[0]) else y
