"""The centre frequencies at which the notch filter stabilises the loop, and the depth that it needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.control.notch_filter import NotchSection
from hsv.flight.scenario import load_scenario
from hsv_paper.designs import design
from hsv_paper.flights import Point
from hsv_paper.linear_loop import Corners, growths, stability_limit
from hsv_paper.plots import BLUE, DOTTED_GREY, RED, letter, new_figure, plain_log
from hsv_paper.sensitivity.sweep import Controller, sweep
from hsv_paper.study import Outcome, Scope, rounded_cell, vehicles

SETS = (Controller("paper-like coupling", "case1", BLUE), Controller("derived coupling", "case1_derived", RED))
"""Both couplings are flown with the baseline's gains and its filter, moved to another centre or depth."""


def run(scope: Scope) -> Outcome:
    """Compute the linear loop over centre and depth of the notch, and flights over its centre, for both couplings."""
    own = design("baseline").notch[0]
    centres = scope.grid(8.0, 26.0, 0.5)
    depths = np.geomspace(0.005, own.pole_damping, scope.count(17, 3))

    def point(coupled: Controller, centre: float) -> Point:
        flown = {"notch.flown.zero_frequency": [centre], "notch.flown.pole_frequency": [centre]}
        return Point(coupled.parameters() | flown, scope.over)

    results = sweep(scope, SETS, centres.tolist(), point)
    figure = new_figure(6.4)
    spec = figure.add_gridspec(2, 2)
    panels: list[Axes] = []
    rows = []
    for column, coupled in enumerate(SETS):
        growths = []
        for index, centre in enumerate(centres.tolist()):
            scope.progress("notch, linear loops", column * len(centres) + index, len(SETS) * len(centres))
            growths.append([_growths(coupled, centre, depth, scope.over) for depth in depths.tolist()])
        axis = figure.add_subplot(spec[0, column], sharey=panels[0] if panels else None)
        shown = _draw_map(axis, centres, depths, np.array(growths))
        axis.plot(own.zero_frequency, own.zero_damping, "k+", markersize=8)
        axis.set_title(coupled.label, loc="right")
        panels.append(axis)
        for over, suffix in ((scope.over[:1], "nominal"), (scope.over, "worst")):
            decay = results[coupled][f"elastic_decay_time_{suffix}"]
            best = int(np.nanargmin(decay)) if np.isfinite(decay).any() else 0
            rows.append(
                {"loop": f"{coupled.label}, {suffix}"}
                | stable_range(coupled, over, centres, depths)
                | {"shortest decay, s": rounded_cell(decay[best], 1), "with the centre at, rad/s": float(centres[best])}
            )
    panels[0].set_ylabel(rf"zero damping $\varepsilon_z$ ({own.pole_damping:g}: no notch)")
    figure.colorbar(shown, ax=panels, label="largest real part (1/s)", aspect=15)
    axis = figure.add_subplot(spec[1, :])
    for coupled, columns in results.items():
        for suffix, style, label in (("nominal", "o-", coupled.label), ("worst", "o--", None)):
            times = columns[f"elastic_decay_time_{suffix}"]
            axis.plot(centres, times, style, color=coupled.color, markersize=2.5, label=label)
        limit = load_scenario(coupled.scenario).limits["elastic_decay_time"]
        axis.axhline(limit, color=coupled.color, linewidth=0.6, linestyle=":")
    axis.axvline(own.zero_frequency, **DOTTED_GREY)
    axis.set(ylim=(0.0, 60.0), ylabel="elastic decay (s)")
    axis.set_xlabel(rf"notch centre (rad/s), $\varepsilon_z$ = {own.zero_damping:g}")
    axis.legend(loc="upper right")
    letter((*panels, axis))
    derived = SETS[1].scenario
    return Outcome(
        figure,
        f"(a), (b) Growth over the centre of the notch and the damping of its zeros, {vehicles(scope.over)}. The "
        "colours and the solid line, the limit of stability, are those of the nominal vehicle; the dashed line is the "
        "limit of the worst corner; the cross is the baseline's filter. Zeros and poles have the same centre; the "
        f"damping of the poles is {own.pole_damping:g}. (c) Decay time in flight; there is no point where a flight is "
        f"lost. The dotted lines are the limits of the scenarios; the scenario {derived} itself flies another design, "
        f"{load_scenario(derived).design}.",
        f"The linear loop is stable with centres from and to, at a zero damping of {own.zero_damping:g}, and up to "
        f"a zero damping, with the centre at {own.zero_frequency:g} rad/s; ≤ and ≥: to the end of the range "
        f"studied ({own.pole_damping:g}: even without a notch).",
        rows,
    )


def stable_range(coupled: Controller, over: Corners, centres: np.ndarray, depths: np.ndarray) -> dict[str, str]:
    """Return table cells: ranges of centre and zero damping in which the loops of all vehicles ``over`` are stable.

    The limits of the centre (rad/s), at the baseline's zero damping, lie on both sides of the most stable centre and
    are bracketed by ``centres``. That of the zero damping, at the baseline's centre, is bracketed by ``depths``.
    """
    own = design("baseline").notch[0]
    around = np.union1d(centres, own.zero_frequency)

    @cache
    def off_centre(centre: float) -> float:
        return float(_growths(coupled, centre, own.zero_damping, over).max())

    def limit(growth: Callable[[float], float], along: np.ndarray, digits: str, sign: str) -> str:
        if growth(float(along[0])) >= 0.0:
            return "unstable"
        found = stability_limit(growth, along.tolist())
        return f"{sign} {along[-1]:g}" if found is None else format(found, digits)

    best = int(np.argmin([off_centre(centre) for centre in around.tolist()]))
    return {
        "centre from, rad/s": limit(off_centre, around[best::-1], ".2f", "≤"),
        "to": limit(off_centre, around[best:], ".2f", "≥"),
        "zero damping up to": limit(
            lambda depth: float(_growths(coupled, own.zero_frequency, depth, over).max()),
            np.array([own.zero_damping, *depths[depths > own.zero_damping]]),
            ".2g",
            "≥",
        ),
    }


def _growths(coupled: Controller, centre: float, zero_damping: float, over: Corners) -> np.ndarray:
    """Return the growths (1/s) by vehicle with the baseline's notch at another ``centre`` (rad/s) and zero damping."""
    section = NotchSection(centre, zero_damping, centre, design("baseline").notch[0].pole_damping)
    return growths(replace(coupled.loop, notch=(section,)), coupled.vehicle, over)


def _draw_map(axis: Axes, centres: np.ndarray, depths: np.ndarray, values: np.ndarray) -> Any:
    """Draw a map of growths (centres, depths, vehicles), nominal vehicle first; return it for a colour bar."""
    levels = np.array([-0.4, -0.3, -0.2, -0.1, 0.0, 0.25, 0.5, 1.0, 1.5])
    nominal, worst = values[..., 0].T, values.max(axis=-1).T
    shown = axis.contourf(centres, depths, nominal, levels=levels, cmap="RdYlBu_r", extend="both", vmin=-1.0, vmax=1.0)
    axis.contour(centres, depths, nominal, levels=[0.0], colors="black", linewidths=1.2)
    axis.contour(centres, depths, worst, levels=[0.0], colors="black", linewidths=1.0, linestyles="--")
    plain_log(axis)
    axis.set_xlabel("notch centre (rad/s)")
    axis.grid(visible=False)
    return shown
