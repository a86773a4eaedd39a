"""Measurements for claims: numbers from certificates, flights of many vehicles, and poles of the sampled loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.certificate.loops import Feedback, Hardware
from hsv.control.notch_filter import NotchSection
from hsv.flight.assembly import flight_parameters
from hsv.flight.corners import Corner, corners, screening_corners
from hsv.flight.scenario import load_scenario
from hsv.model.actuators import ACTUATOR_SETS, IDEAL
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import certificate, design
from hsv_paper.flights import Point, Table, fly_over
from hsv_paper.linear_loop import growths

ELEVATORS = {name: ACTUATOR_SETS[name] for name in ("elevator_150", "elevator_50", "elevator_20")}
"""Elevators that a claim may name, each flown with the fuel delivery of 10 rad/s; the paper's are ideal."""


class Evidence:
    """Measurements for the claims; each is computed once, when it is first requested."""

    def __init__(
        self,
        progress: Progress = lambda what, done, total: None,
        over: Sequence[Corner] | None = None,
        elevator: str = IDEAL,
        loops: Sequence[Corner] | None = None,
    ) -> None:
        """Prepare the evidence without computing anything.

        Args:
            over: Vehicles to fly, the nominal one first; by default the nominal vehicle and all corners.
            elevator: Elevator in loops and flights, ideal or one of :data:`ELEVATORS`.
            loops: Vehicles of the linear loops; by default those of ``over``.
        """
        self._progress = progress
        self.hardware = Hardware.of(elevator)
        sets = {} if elevator == IDEAL else {"fuel_equivalence_ratio": "fuel_10", "elevator_deflection": elevator}
        self._equipment = tuple((f"actuator.{channel}.set", name) for channel, name in sets.items())
        self.over = corners(load_vehicle().uncertainty) if over is None else over
        self._loops = self.over if loops is None else loops
        self.corners = cache(self._corners)
        self.changed = cache(self._changed)
        self.growth = cache(self._growth)
        self.behind = cache(self._behind)

    def _behind(self, elevator: str) -> Evidence:
        """Return this object for the ideal ``elevator``, else evidence with that one, for at most 33 vehicles."""
        if elevator == IDEAL:
            return self
        over = [corner for corner in screening_corners(load_vehicle().uncertainty) if corner in self.over]
        return Evidence(self._progress, over, elevator, self._loops)

    def _values(self, scenario: str, changes: Sequence[tuple[str, Any]]) -> dict[str, Any]:
        return {**flight_parameters(load_scenario(scenario)), **dict((*self._equipment, *changes))}

    def _corners(self, scenario: str, *changes: tuple[str, Any]) -> Table:
        """Return the measures of a scenario by vehicle; ``changes``: names and new values of flat parameters."""
        what = " ".join((scenario, *(f"{name}={value}" for name, value in (*self._equipment, *changes))))
        point = Point(self._values(scenario, changes), self.over)
        return fly_over(point, lambda done: self._progress(what, done, len(self.over)))

    def _changed(self, scenario: str, *changes: tuple[str, Any]) -> dict[str, float]:
        """Return the measures of the nominal vehicle in a scenario; ``changes`` as for :meth:`_corners`."""
        table = fly_over(Point(self._values(scenario, changes), [{}]))
        return {name: float(column[0]) for name, column in table.items()}

    def uncertain(self, scenario: str, measure: str, *changes: tuple[str, Any]) -> float:
        """Return the magnitude of a measure in the flight with uncertain parameters; NaN if it is not defined.

        For ``case1_...`` this flight is the scenario ``case1_uncertain_...``, and likewise for Case 2.
        """
        case, _, rest = scenario.partition("_")
        flight = self.changed("_".join(filter(None, (case, "uncertain", rest))), *changes)
        return abs(flight.get(measure, np.nan))

    def magnitudes(self, scenario: str, measure: str, *changes: tuple[str, Any]) -> np.ndarray:
        """Return the magnitudes of a measure in the flights of a scenario, one per vehicle, the nominal one first."""
        return np.abs(self.corners(scenario, *changes)[measure])

    def _growth(
        self, coupling: str, notch: tuple[NotchSection, ...], name: str = "baseline", factor: float = 1.0
    ) -> np.ndarray:
        """Return the growth (1/s), by vehicle, of the sampled loop with ``factor`` times F of the design ``name``.

        It is the largest real part of all poles, at Case 1's start and target, before and after its fault.
        """
        self._progress(f"poles, {coupling} coupling", 0, 1)
        loop = Feedback(factor * design(name).feedback_gain, notch, design(name).period, self.hardware)
        return growths(loop, load_vehicle().coupled(coupling), self._loops)


def certified(entry: str) -> np.ndarray:
    """Return the numbers, shape (n,), at ``design:path.to.entry`` of a certificate, from all items of any list."""
    name, _, path = entry.partition(":")
    found = [certificate(name)]
    for key in path.split("."):
        found = [item for value in found for item in np.atleast_1d(value[key])]
    return np.array(found)


def shown(value: float, unit: str, digits: int = 4) -> str:
    """Return a number (SI) as text in the paper's unit, NaN and infinity as words ("not by the end" for a time)."""
    if not math.isfinite(value):
        return "not defined" if math.isnan(value) else "not by the end" if unit == "s" else "unbounded"
    number, name = to_paper(value, unit)
    return f"{number:.{digits}g}" + ("" if name == "1" else f" {name}")


def worst(values: np.ndarray) -> float:
    """Return the largest of ``values``, one per vehicle; infinite if any is NaN, as for a lost vehicle."""
    return float(np.inf) if np.any(np.isnan(values)) else float(values.max())
