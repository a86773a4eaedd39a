"""Sources for measuring claims: certificates, flights of many vehicles, and the sampled loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.control.design import find_design, read_parameters
from hsv.control.notch_filter import NotchSection
from hsv.flight.assembly import flight_parameters
from hsv.flight.corners import Corner, corners, screening_corners
from hsv.flight.scenario import load_scenario
from hsv.model.actuators import ACTUATOR_SETS, IDEAL
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import certificate, design
from hsv_paper.flights import Flights, Point, Table, fly_over
from hsv_paper.linear_loop import Feedback, Hardware

FUEL = ACTUATOR_SETS["fuel_10"]
"""The fuel delivery that goes with every elevator which is not ideal."""

ELEVATORS = {IDEAL: ()} | {name: (FUEL, ACTUATOR_SETS[name]) for name in ("elevator_150", "elevator_50", "elevator_20")}
"""Actuators that readings may name, as the linear loop has them; those of the paper are ideal."""


class Evidence:
    """Measurements for the claims; each is computed once, when it is first requested."""

    def __init__(
        self,
        folder: Path,
        progress: Progress = lambda what, done, total: None,
        over: Sequence[Corner] | None = None,
        actuators: str = IDEAL,
        loops: Sequence[Corner] | None = None,
    ) -> None:
        """Keep tables in ``folder``.

        Args:
            folder: Folder of tables and flights.
            progress: Called with the current measurement.
            over: Vehicles that are flown, the nominal one first; by default all corners.
            actuators: Actuators in loops and flights, from :data:`ELEVATORS`.
            loops: Vehicles of the linear loops; by default those that are flown.
        """
        self._folder = folder
        self._progress = progress
        self.hardware = Hardware(ELEVATORS[actuators])
        equipped = () if actuators == IDEAL else ("fuel_10", actuators)
        self._equipment = tuple((f"actuator.{ACTUATOR_SETS[name].channel}.set", name) for name in equipped)
        self.over = corners(load_vehicle().uncertainty) if over is None else over
        self._loops = self.over if loops is None else loops
        self.flights = Flights(folder, progress)
        self.corners = cache(self._corners)
        self.changed = cache(self._changed)
        self.growth = cache(self._growth)
        self.behind = cache(self._behind)

    @property
    def vehicles(self) -> int:
        """Number of vehicles in a table: the nominal one and those at corners."""
        return len(self.over)

    def _behind(self, actuators: str) -> Evidence:
        """Return the evidence with these actuators: this one if they are ideal, else flights of at most 32 corners."""
        if actuators == IDEAL:
            return self
        over = [corner for corner in screening_corners(load_vehicle().uncertainty) if corner in self.over]
        return Evidence(self._folder, self._progress, over, actuators, self._loops)

    def _values(self, scenario: str, changes: Sequence[tuple[str, Any]]) -> dict[str, Any]:
        return {**flight_parameters(load_scenario(scenario)), **dict((*self._equipment, *changes))}

    def _corners(self, scenario: str, *changes: tuple[str, Any]) -> Table:
        """Return the measurements of a scenario with the nominal vehicle (first) and at all corners."""
        what = " ".join((scenario, *(f"{name}={value}" for name, value in (*self._equipment, *changes))))
        points = [Point(self._values(scenario, changes), self.over)]
        return self.flights.tables(f"{self.vehicles} vehicles {what}", points)[0]

    def _changed(self, scenario: str, *changes: tuple[str, Any]) -> dict[str, float]:
        """Return the measurements of the nominal flight of a scenario with other parameters."""
        return _nominal_flight(self._values(scenario, changes))

    def adjustable_step(self) -> dict[str, float]:
        """Return the measurements on the step of Case 1 with the adjustable design."""
        return _nominal_flight({**read_parameters(find_design("adjustable")), **load_scenario("case1").parameters()})

    def uncertain(self, scenario: str, measure: str, *changes: tuple[str, Any]) -> float:
        """Return the magnitude of a measure with the uncertain parameters of Case 1 and 2; NaN where not defined.

        The uncertain flight of ``case1_...`` is that of ``case1_uncertain_...``, and so for Case 2.
        """
        case, _, rest = scenario.partition("_")
        flight = self.changed("_".join(filter(None, (case, "uncertain", rest))), *changes)
        return abs(flight.get(measure, np.nan))

    def magnitudes(self, scenario: str, measure: str, *changes: tuple[str, Any]) -> np.ndarray:
        """Return the magnitude (vehicles) of a measure, the nominal vehicle first."""
        return np.abs(self.corners(scenario, *changes)[measure])

    def _growth(
        self, coupling: str, notch: tuple[NotchSection, ...], name: str = "baseline", factor: float = 1.0
    ) -> np.ndarray:
        """Return the largest real part, 1/s, of the sampled loop's poles, by vehicle, the nominal one first.

        It is the largest of both ends of the step, before and after the fault. ``factor`` multiplies the feedback.
        """
        loop = Feedback(factor * design(name).feedback_gain, notch, design(name).period, self.hardware)
        vehicle, what = load_vehicle().coupled(coupling), f"poles, {coupling}, {'with' if notch else 'without'} notch"
        found = []
        for number, corner in enumerate(self._loops):
            if number % 50 == 0:
                self._progress(what, number, len(self._loops))
            found.append(loop.growth(vehicle, [corner]))
        self._progress(what, len(self._loops), len(self._loops))
        return np.array(found)


def certified(entry: str) -> np.ndarray:
    """Return the numbers in an entry of a certificate, ``design:path.to.entry``, those of all elements of lists."""
    name, _, path = entry.partition(":")
    found = [certificate(name)]
    for key in path.split("."):
        found = [item for value in found for item in np.atleast_1d(value[key])]
    return np.array(found)


def shown(value: float, unit: str, digits: int = 4) -> str:
    """Return a number (SI) with the paper's unit; an infinite time is beyond the end of the flight."""
    if not math.isfinite(value):
        return "not defined" if math.isnan(value) else "not by the end" if unit == "s" else "unbounded"
    number, name = to_paper(value, unit)
    return f"{number:.{digits}g}" + ("" if name == "1" else f" {name}")


def nominal(table: Table, measure: str) -> float:
    """Return a measure of the nominal vehicle."""
    return float(table[measure][0])


def worst(table: Table, measure: str) -> float:
    """Return the largest magnitude over all vehicles; infinite where one diverged or does not define it."""
    values = np.abs(table[measure])
    return float(np.inf) if np.any(np.isnan(values)) else float(values.max())


def _nominal_flight(values: dict[str, Any]) -> dict[str, float]:
    return {name: float(column[0]) for name, column in fly_over(Point(values, [{}])).items()}
