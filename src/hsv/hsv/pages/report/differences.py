"""Differences between runs and the first of them, step by step, in double precision, before any rounding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsv.pages.report.panels import Kind, Panel
from hsv.pages.report.run import ReportedRun

COMPARED = ("trajectory", "attitude", "elastic", "inputs", "tube")
"""Groups of panels of which differences are drawn, errors in the tube aside: they repeat those of the state."""

NEARLY = 0.01
"""Share of a quantity's range up to which flights are said to nearly agree."""


@dataclass(frozen=True)
class RunDifference:
    """Difference of a run from the first one, SI, at the steps (n) that both have; time in seconds."""

    run: int
    time: np.ndarray
    y: np.ndarray
    range: float
    """Range from the smallest to the largest value of the first run."""

    @property
    def largest(self) -> float:
        """The largest magnitude."""
        return float(np.nanmax(np.abs(self.y)))

    @property
    def at(self) -> float:
        """Time of the difference in seconds."""
        return float(self.time[np.nanargmax(np.abs(self.y))])

    @property
    def share(self) -> float:
        """The largest magnitude for the range; infinite where the first run does not move, zero without difference."""
        if not self.largest:
            return 0.0
        return self.largest / self.range if self.range else np.inf


@dataclass(frozen=True)
class Difference:
    """The differences in the curve that a panel is about."""

    panel: Panel
    runs: tuple[RunDifference, ...]

    @property
    def name(self) -> str:
        """Name of the panel that plots them."""
        return f"difference_{self.panel.name}"

    @property
    def none(self) -> bool:
        """Whether all runs agree, bit for bit."""
        return not any(run.largest for run in self.runs)


def differences(runs: Sequence[ReportedRun]) -> list[Difference]:
    """Return how each run but the first differs from it, by panel, in the order of the page."""
    found = []
    for panel in runs[0].curves.panels:
        if panel.group in COMPARED and not panel.name.startswith("error_"):
            each = [_difference(panel, runs[0], index, run) for index, run in enumerate(runs[1:], 1)]
            if known := tuple(difference for difference in each if difference is not None):
                found.append(Difference(panel, known))
    return found


def _difference(panel: Panel, first: ReportedRun, index: int, run: ReportedRun) -> RunDifference | None:
    ours, theirs = _curve(panel, first), _curve(panel, run)
    if ours is None or theirs is None:
        return None
    clock, other_clock = (np.round(each.curves.time * 1e9).astype(np.int64) for each in (first, run))
    _, rows, other_rows = np.intersect1d(clock, other_clock, assume_unique=True, return_indices=True)
    y = theirs[other_rows] - ours[rows]
    if not np.isfinite(y).any():
        return None
    finite = ours[np.isfinite(ours)]
    return RunDifference(index, first.curves.time[rows], y, float(np.ptp(finite)))


def _curve(panel: Panel, run: ReportedRun) -> np.ndarray | None:
    return next((curve.y for curve in run.curves.curves.get(panel.name, ()) if curve.kind is Kind.actual), None)
