"""Permitted frequencies of the notch filter, and its required depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet

from hsv.base.processes import Progress
from hsv.control.design import find_design, read_design
from hsv.control.notch_filter import NotchSection
from hsv.flight.corners import Corner
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import BLUE, GREY, RED, letter, new_figure, plain_log
from hsv_paper.linear_loop import stability_limit
from hsv_paper.sensitivity.controllers import Controller, corners_of, growth, said_corners
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_result import SweepResult

SETS = (
    Controller("paper-like coupling", "case1", BLUE),
    Controller("derived coupling", "case1_derived", RED),
)
"""Both have the gains of the baseline and its filter, with another centre or depth."""


@cache
def filter_of_the_baseline() -> NotchSection:
    """Return the section that the baseline design flies with."""
    return read_design(find_design("baseline")).notch[0]


def moved(centre: float, zero_damping: float | None = None) -> NotchSection:
    """Return the baseline's section with zeros and poles at ``centre`` (rad/s), and another damping of the zeros."""
    own = filter_of_the_baseline()
    damping = own.zero_damping if zero_damping is None else zero_damping
    return NotchSection(centre, damping, centre, own.pole_damping)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Linearise the loop over centre and depth, and fly it over the centre, for both sets of coupling."""
    own = filter_of_the_baseline()
    centres = grid(8.0, 26.0, 0.5, coarseness)
    depths = np.geomspace(0.005, own.pole_damping, max(3, round(17 / coarseness)))
    over = corners_of(1.0, coarseness)
    maps: dict[Controller, np.ndarray] = {}
    limits: dict[Controller, tuple[Limits, Limits]] = {}
    total = len(SETS) * len(centres)
    for number, coupled in enumerate(SETS):
        rows = []
        for index, centre in enumerate(centres):
            progress("notch, linear loops", number * len(centres) + index, total)
            rows.append([_growths(coupled, moved(float(centre), float(depth)), over) for depth in depths])
        maps[coupled] = np.array(rows)
        limits[coupled] = (_limits(coupled, over[:1], centres, depths), _limits(coupled, over, centres, depths))
    progress("notch, linear loops", total, total)
    along = {coupled: [Point(_values(coupled, float(centre)), over) for centre in centres] for coupled in SETS}
    results = sweep("notch", along, folder, progress)

    figure = new_figure(6.4)
    spec = figure.add_gridspec(2, 2)
    panels: list[Axes] = []
    for column, (coupled, values) in enumerate(maps.items()):
        axis = figure.add_subplot(spec[0, column], sharey=panels[0] if panels else None)
        shown = _draw_map(axis, centres, depths, values)
        axis.plot(own.zero_frequency, own.zero_damping, "k+", markersize=8)
        axis.set_title(coupled.label, loc="right")
        panels.append(axis)
    panels[0].set_ylabel(rf"zero damping $\varepsilon_z$ ({own.pole_damping:g}: no notch)")
    figure.colorbar(shown, ax=panels, label="largest real part (1/s)", aspect=15)
    axis = figure.add_subplot(spec[1, :])
    for coupled, columns in results.items():
        for suffix, style in (("nominal", "-"), ("worst", "--")):
            label = coupled.label if suffix == "nominal" else None
            decay = columns[f"elastic_decay_time_{suffix}"]
            axis.plot(centres, decay, f"o{style}", color=coupled.color, markersize=2.5, label=label)
        limit = load_scenario(coupled.scenario).limits["elastic_decay_time"]
        axis.axhline(limit, color=coupled.color, linewidth=0.6, linestyle=":")
    axis.axvline(own.zero_frequency, color=GREY, linewidth=0.6, linestyle=":")
    axis.set_ylim(0.0, 60.0)
    axis.set_xlabel(rf"notch centre (rad/s), $\varepsilon_z$ = {own.zero_damping:g}")
    axis.set_ylabel("elastic decay (s)")
    axis.legend(loc="upper right")
    letter((*panels, axis))
    return Outcome(
        figure,
        "(a), (b) Largest real part of the poles of the sampled loop over the centre of the notch and the damping of "
        "its zeros, over both ends of the step, before and after the fault. The colours and the solid line, the limit "
        "of stability, are those of the nominal vehicle; the dashed line is the limit of the worst of "
        f"{said_corners(over)} of the parameter bounds; the cross is the baseline's filter. Zeros and poles have the "
        f"same centre; the damping of the poles is {own.pole_damping:g}. (c) Decay time in flight, nominal vehicle "
        "(solid) and worst corner (dashed); there is no point where a flight is lost. The dotted lines are the limits "
        f"of the scenarios; the scenario {SETS[1].scenario} itself flies another design, "
        f"{load_scenario(SETS[1].scenario).design}.",
        tuple(_finding(c, limits[c], results[c], centres, said_corners(over)) for c in SETS),
        {
            "centre_rad_per_s": centres.tolist(),
            "zero_damping": depths.tolist(),
            "growth_per_s": {
                c.label: {"nominal": m[..., 0].tolist(), "worst": m.max(axis=-1).tolist()} for c, m in maps.items()
            },
            "stable": {c.label: {"nominal": vars(n), "worst": vars(w)} for c, (n, w) in limits.items()},
            "flights": {c.label: columns for c, columns in results.items()},
        },
    )


@dataclass(frozen=True)
class Limits:
    """Range of stability: from ``least`` to ``largest`` centre (rad/s), up to ``shallowest`` damping of zeros.

    While one is varied, the other is the baseline's. ``None``: to the end of the range studied; not a number: nowhere.
    """

    least: float | None
    largest: float | None
    shallowest: float | None

    def said(self, centres: np.ndarray) -> str:
        """Return the limits in words; ``centres``: those studied."""
        own = filter_of_the_baseline()
        least = f"{centres[0]:g}" if self.least is None else f"{self.least:.2f}"
        largest = f"{centres[-1]:g}" if self.largest is None else f"{self.largest:.2f}"
        if self.least is None and self.largest is None:
            span = f"stable with every centre from {least} to {largest} rad/s"
        elif self.least is not None and np.isnan(self.least):
            span = f"stable with no centre at a zero damping of {own.zero_damping:g}"
        else:
            span = f"stable with the centre from {least} to {largest} rad/s"
        if self.shallowest is None:
            depth = f"stable at every zero damping, even at {own.pole_damping:g} (no notch)"
        elif np.isnan(self.shallowest):
            depth = f"unstable at a zero damping of {own.zero_damping:g}"
        else:
            depth = f"stable up to a zero damping of {self.shallowest:.2g}"
        return f"{span}; with the centre at {own.zero_frequency:g} rad/s, it is {depth}"


def _limits(coupled: Controller, over: list[Corner], centres: np.ndarray, depths: np.ndarray) -> Limits:
    own = filter_of_the_baseline()
    centres = np.union1d(centres, own.zero_frequency)

    @cache
    def off_centre(centre: float) -> float:
        return max(_growths(coupled, moved(centre), over))

    def shallow(depth: float) -> float:
        return max(_growths(coupled, moved(own.zero_frequency, depth), over))

    def limit(growth: Callable[[float], float], along: np.ndarray) -> float | None:
        return np.nan if growth(float(along[0])) >= 0.0 else stability_limit(growth, along.tolist())

    best = int(np.argmin([off_centre(float(centre)) for centre in centres]))
    return Limits(
        limit(off_centre, centres[best::-1]),
        limit(off_centre, centres[best:]),
        limit(shallow, np.array([own.zero_damping, *depths[depths > own.zero_damping]])),
    )


def _growths(coupled: Controller, section: NotchSection, over: list[Corner]) -> list[float]:
    vehicle = load_vehicle().coupled(load_scenario(coupled.scenario).vehicle.coupling)
    return [growth(coupled, vehicle.perturbed(corner), notch=[section]) for corner in over]


def _values(coupled: Controller, centre: float) -> dict[str, object]:
    flown = {"notch.flown.zero_frequency": [centre], "notch.flown.pole_frequency": [centre]}
    return coupled.parameters() | flown


def _draw_map(axis: Axes, centres: np.ndarray, depths: np.ndarray, values: np.ndarray) -> ContourSet:
    """Draw growths (centres, depths, vehicles), the nominal vehicle first; return what a colour bar is made of."""
    levels = np.array([-0.4, -0.3, -0.2, -0.1, 0.0, 0.25, 0.5, 1.0, 1.5])
    nominal, worst = values[..., 0].T, values.max(axis=-1).T
    shown = axis.contourf(centres, depths, nominal, levels=levels, cmap="RdYlBu_r", extend="both", vmin=-1.0, vmax=1.0)
    axis.contour(centres, depths, nominal, levels=[0.0], colors="black", linewidths=1.2)
    axis.contour(centres, depths, worst, levels=[0.0], colors="black", linewidths=1.0, linestyles="--")
    plain_log(axis)
    axis.set_xlabel("notch centre (rad/s)")
    axis.grid(visible=False)
    return shown


def _finding(
    coupled: Controller, limits: tuple[Limits, Limits], columns: SweepResult, centres: np.ndarray, of: str
) -> str:
    nominal, worst = (found.said(centres) for found in limits)
    best = {}
    for suffix in ("nominal", "worst"):
        decay = np.array(columns[f"elastic_decay_time_{suffix}"])
        if np.isfinite(decay).any():
            least = int(np.nanargmin(decay))
            best[suffix] = f"{decay[least]:.1f} s with the centre at {centres[least]:.1f} rad/s"
    flights = " and ".join(
        f"{best.get(suffix, 'undefined, as a flight is lost with every centre')} ({vehicle})"
        for suffix, vehicle in (("nominal", "nominal vehicle"), ("worst", "worst corner"))
    )
    return (
        f"{coupled.label}: the linear loop of the nominal vehicle is {nominal}. That of the worst of {of} is {worst}. "
        f"The shortest decay time in flight is {flights}"
    )


STUDY = Study("notch", "Centre and depth of the notch filter", run)
