"""Permitted frequencies of the notch filter, and its required depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.control.notch_filter import NotchSection
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.flights import Point
from hsv_paper.linear_loop import Corners, stability_limit
from hsv_paper.plots import BLUE, DOTTED_GREY, RED, letter, new_figure, plain_log
from hsv_paper.sensitivity.sweep import Columns, Controller, feedback, labelled, sweep
from hsv_paper.study import Outcome, Scope, in_words

SETS = (
    Controller("paper-like coupling", "case1", BLUE),
    Controller("derived coupling", "case1_derived", RED),
)
"""Both have the gains of the baseline and its filter, with another centre or depth."""


def run(scope: Scope) -> Outcome:
    """Linearise the loop over centre and depth, and fly it over the centre, for both sets of coupling."""
    own = design("baseline").notch[0]
    centres = scope.grid(8.0, 26.0, 0.5)
    depths = np.geomspace(0.005, own.pole_damping, scope.count(17, 3))
    maps, limits = {}, {}
    for number, coupled in enumerate(SETS):
        rows = []
        for index, centre in enumerate(centres.tolist()):
            scope.progress("notch, linear loops", number * len(centres) + index, len(SETS) * len(centres))
            rows.append([_growths(coupled, centre, depth, scope.over) for depth in depths.tolist()])
        maps[coupled] = np.array(rows)
        limits[coupled] = [Limits.of(coupled, over, centres, depths) for over in (scope.over[:1], scope.over)]
    scope.progress("notch, linear loops", len(SETS) * len(centres), len(SETS) * len(centres))

    def point(coupled: Controller, centre: float) -> Point:
        flown = {"notch.flown.zero_frequency": [centre], "notch.flown.pole_frequency": [centre]}
        return Point(coupled.parameters() | flown, scope.over)

    results = sweep(scope, "notch", {c: [point(c, centre) for centre in centres.tolist()] for c in SETS})
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
        for suffix, style, label in (("nominal", "o-", coupled.label), ("worst", "o--", None)):
            decay = columns[f"elastic_decay_time_{suffix}"]
            axis.plot(centres, decay, style, color=coupled.color, markersize=2.5, label=label)
        limit = load_scenario(coupled.scenario).limits["elastic_decay_time"]
        axis.axhline(limit, color=coupled.color, linewidth=0.6, linestyle=":")
    axis.axvline(own.zero_frequency, **DOTTED_GREY)
    axis.set(ylim=(0.0, 60.0), ylabel="elastic decay (s)")
    axis.set_xlabel(rf"notch centre (rad/s), $\varepsilon_z$ = {own.zero_damping:g}")
    axis.legend(loc="upper right")
    letter((*panels, axis))
    corners, derived = in_words(scope.over), SETS[1].scenario
    return Outcome(
        figure,
        "(a), (b) Largest real part of the poles of the sampled loop over the centre of the notch and the damping of "
        "its zeros, over both ends of the step, before and after the fault. The colours and the solid line, the limit "
        f"of stability, are those of the nominal vehicle; the dashed line is the limit of the worst of {corners} of "
        "the parameter bounds; the cross is the baseline's filter. Zeros and poles have the same centre; the damping "
        f"of the poles is {own.pole_damping:g}. (c) Decay time in flight, nominal vehicle (solid) and worst corner "
        "(dashed); there is no point where a flight is lost. The dotted lines are the limits of the scenarios; the "
        f"scenario {derived} itself flies another design, {load_scenario(derived).design}.",
        [_finding(c, limits[c], results[c], centres, corners) for c in SETS],
        {
            "centre_rad_per_s": centres.tolist(),
            "zero_damping": depths.tolist(),
            "growth_per_s": {
                c.label: {"nominal": m[..., 0].tolist(), "worst": m.max(axis=-1).tolist()} for c, m in maps.items()
            },
            "stable": {c.label: {"nominal": vars(n), "worst": vars(w)} for c, (n, w) in limits.items()},
            "flights": labelled(results),
        },
    )


@dataclass(frozen=True)
class Limits:
    """Range of stability: from ``least`` to ``largest`` centre (rad/s), up to ``shallowest`` damping of zeros.

    While one is varied, the other is the baseline's. ``None``: to the end of the range studied; NaN: nowhere.
    """

    least: float | None
    largest: float | None
    shallowest: float | None

    @classmethod
    def of(cls, coupled: Controller, over: Corners, centres: np.ndarray, depths: np.ndarray) -> Limits:
        """Return the limits of the worst of the vehicles ``over``, bracketed in ``centres`` and ``depths``."""
        own = design("baseline").notch[0]
        centres = np.union1d(centres, own.zero_frequency)

        @cache
        def off_centre(centre: float) -> float:
            return max(_growths(coupled, centre, own.zero_damping, over))

        def limit(growth: Callable[[float], float], along: np.ndarray) -> float | None:
            return np.nan if growth(float(along[0])) >= 0.0 else stability_limit(growth, along.tolist())

        best = int(np.argmin([off_centre(centre) for centre in centres.tolist()]))
        return cls(
            limit(off_centre, centres[best::-1]),
            limit(off_centre, centres[best:]),
            limit(
                lambda depth: max(_growths(coupled, own.zero_frequency, depth, over)),
                np.array([own.zero_damping, *depths[depths > own.zero_damping]]),
            ),
        )

    def in_words(self, centres: np.ndarray) -> str:
        """Return the limits in words; ``centres``: those studied."""
        own = design("baseline").notch[0]
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


def _growths(coupled: Controller, centre: float, zero_damping: float, over: Corners) -> list[float]:
    """Return the growth (1/s) by vehicle with the baseline's section moved to a ``centre`` (rad/s)."""
    section = NotchSection(centre, zero_damping, centre, design("baseline").notch[0].pole_damping)
    loop = replace(feedback(coupled), notch=(section,))
    vehicle = load_vehicle().coupled(load_scenario(coupled.scenario).vehicle.coupling)
    return [loop.growth(vehicle, [corner]) for corner in over]


def _draw_map(axis: Axes, centres: np.ndarray, depths: np.ndarray, values: np.ndarray) -> Any:
    """Draw growths (centres, depths, vehicles), the nominal vehicle first; return the base of a colour bar."""
    levels = np.array([-0.4, -0.3, -0.2, -0.1, 0.0, 0.25, 0.5, 1.0, 1.5])
    nominal, worst = values[..., 0].T, values.max(axis=-1).T
    shown = axis.contourf(centres, depths, nominal, levels=levels, cmap="RdYlBu_r", extend="both", vmin=-1.0, vmax=1.0)
    axis.contour(centres, depths, nominal, levels=[0.0], colors="black", linewidths=1.2)
    axis.contour(centres, depths, worst, levels=[0.0], colors="black", linewidths=1.0, linestyles="--")
    plain_log(axis)
    axis.set_xlabel("notch centre (rad/s)")
    axis.grid(visible=False)
    return shown


def _finding(coupled: Controller, limits: list[Limits], columns: Columns, centres: np.ndarray, corners: str) -> str:
    nominal, worst = (found.in_words(centres) for found in limits)
    shortest = []
    for suffix, vehicle in (("nominal", "nominal vehicle"), ("worst", "worst corner")):
        decay, text = (
            np.array(columns[f"elastic_decay_time_{suffix}"]),
            "undefined, as a flight is lost with every centre",
        )
        if np.isfinite(decay).any():
            least = int(np.nanargmin(decay))
            text = f"{decay[least]:.1f} s with the centre at {centres[least]:.1f} rad/s"
        shortest.append(f"{text} ({vehicle})")
    return (
        f"{coupled.label}: the linear loop of the nominal vehicle is {nominal}. That of the worst of {corners} is "
        f"{worst}. The shortest decay time in flight is {' and '.join(shortest)}"
    )
