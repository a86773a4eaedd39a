"""What claims are measured on: designs with their certificates, corner flights, and the sampled loop."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hsv.control.design_file import find_design, read_parameters
from hsv.control.notch_filter import NotchSection
from hsv.design.region import corners
from hsv.simulation.assembly import flight_parameters
from hsv.simulation.scenario import load_scenario
from hsv.study.corner_flights import Table, corner_table, fly_over
from hsv.study.figures.figure import Design
from hsv.study.flights import Flights
from hsv.study.linear_loop import worst_growth
from hsv.vehicle.parameters import vehicle_parameters

Progress = Callable[[str, int, int], None]


class Evidence:
    """Measured once, when first asked for."""

    def __init__(self, folder: Path, progress: Progress = lambda what, done, total: None) -> None:
        """Keep flights and corner tables in ``folder``."""
        self._folder = folder
        self._progress = progress
        self.flights = Flights(folder, graph=False, progress=progress)
        self.design = cache(Design)
        self.corners = cache(self._corners)
        self.changed = cache(self._changed)
        self.growth = cache(self._growth)

    @cached_property
    def half_width(self) -> np.ndarray:
        """Half-widths (5) of the baseline's set, by which errors of different states are compared."""
        tube = self.design("baseline").flown.tube
        assert tube is not None
        return tube.half_width[:5]

    def _corners(self, scenario: str) -> Table:
        """Return what was measured on a scenario with the nominal vehicle (first) and at all corners."""
        return corner_table(scenario, self._folder, self.half_width, self._progress)

    def _changed(self, scenario: str, *changes: tuple[str, Any]) -> dict[str, float]:
        """Return what was measured on the nominal flight of a scenario with other parameters."""
        values = {**flight_parameters(load_scenario(scenario)), **dict(changes)}
        return {name: float(column[0]) for name, column in fly_over(values, [{}], self.half_width).items()}

    def adjustable_step(self) -> dict[str, float]:
        """Return what was measured on the step of Case 1 with the adjustable design."""
        design = read_parameters(find_design("adjustable"))
        values = {**design, **load_scenario("case1").parameters()}
        return {name: float(column[0]) for name, column in fly_over(values, [{}], self.half_width).items()}

    def _growth(self, coupling: str, notch: tuple[NotchSection, ...], design: str = "baseline") -> np.ndarray:
        """Return the largest real part (1025), 1/s, of the sampled loop's poles: nominal vehicle first, then corners.

        The worst of both ends of the step, before and after the fault.
        """
        flown, over, found = self.design(design).flown, corners(), []
        what = f"poles, {coupling} coupling, {'with' if notch else 'without'} notch"
        for number, corner in enumerate(over):
            if number % 50 == 0:
                self._progress(what, number, len(over))
            vehicle = vehicle_parameters(coupling).perturbed(corner)
            found.append(worst_growth(vehicle, flown.feedback_gain, notch, flown.period))
        self._progress(what, len(over), len(over))
        return np.array(found)


def nominal(table: Table, measure: str) -> float:
    """Return what was measured on the nominal vehicle."""
    return float(table[measure][0])


def worst(table: Table, measure: str) -> float:
    """Return the largest magnitude over all vehicles; infinite where one diverged or does not define it."""
    values = np.abs(table[measure])
    return float(np.inf) if np.any(np.isnan(values)) else float(values.max())
