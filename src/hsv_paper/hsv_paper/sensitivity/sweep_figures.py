"""Plots and findings of sweeps of flights: every controller over one quantity, nominal vehicle and corners."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import to_paper
from hsv_paper.figures.style import letter, plain_log
from hsv_paper.sensitivity.controllers import Controller
from hsv_paper.sensitivity.sweep_result import SweepResult


def widths(count: int) -> np.ndarray:
    """Return line widths for curves drawn one after another, each thinner, so that none hides another."""
    return 0.8 + 0.3 * np.arange(count)[::-1]


def draw_metric(
    axis: Axes, x: np.ndarray, results: dict[Controller, SweepResult], name: str, unit: str, label: str
) -> None:
    """Draw a metric of every controller: solid the nominal vehicle, dashed the worst."""
    factor = to_paper(1.0, unit)[0]
    for (controller, columns), width in zip(results.items(), widths(len(results)), strict=True):
        for suffix, style in (("nominal", "-"), ("worst", "--")):
            values = factor * np.array(columns[f"{name}_{suffix}"])
            axis.plot(x, values, style, color=controller.color, linewidth=width)
    axis.set_ylabel(label)


def draw_share(axis: Axes, x: np.ndarray, results: dict[Controller, SweepResult]) -> None:
    """Draw the share of flights that finish (solid), and of those that finish without saturation (dotted)."""
    for (controller, columns), width in zip(results.items(), widths(len(results)), strict=True):
        shares = {name: 100.0 * np.array(columns[name]) for name in ("finished", "without_limits")}
        axis.plot(x, shares["finished"], color=controller.color, linewidth=width, label=controller.label)
        axis.plot(x, shares["without_limits"], ":", color=controller.color, linewidth=width)
    axis.set_ylabel("flights (%)")
    axis.set_ylim(-5.0, 105.0)


def legend(figure: Figure, *, shares: bool) -> None:
    """Add a legend of controllers and line styles above the panels; ``shares``: one panel is of shares."""
    controllers, _ = figure.axes[0].get_legend_handles_labels()
    styles = {"-": "nominal vehicle", "--": "worst corner"}
    if shares:
        styles["-"] = "nominal vehicle; (a): flown to the end"
        styles[":"] = "(a): not a second at the limits"
    keys = [Line2D([], [], color="black", linestyle=s, linewidth=0.9, label=text) for s, text in styles.items()]  # type: ignore[arg-type]
    figure.legend(handles=[*controllers, *keys], loc="outside upper center", ncols=3, frameon=False)


def draw_losses(figure: Figure, x: np.ndarray, results: dict[Controller, SweepResult], label: str) -> np.ndarray:
    """Draw and return three panels over ``x``: share of lost flights, attitude after the fault, altitude at the end.

    Args:
        figure: Empty.
        x: Values along the sweeps.
        results: Results by controller.
        label: Label of ``x``.
    """
    axes = np.asarray(figure.subplots(3, 1, sharex=True))
    draw_share(axes[0], x, results)
    draw_metric(axes[1], x, results, "post_fault_attitude_deviation", "rad", "attitude excursion (deg)")
    draw_metric(axes[2], x, results, "altitude_end_error", "m", "altitude error at end (ft)")
    for axis in axes[1:]:
        plain_log(axis)
    axes[2].set_xlabel(label)
    letter(axes)
    legend(figure, shares=True)
    return axes


SATURATED = "A flight counts as saturated if its inputs are at their limits for more than a second, or if it is lost."
"""Explanation of the word in findings."""

LOSSES = (
    "(a) Share of the flights that are not lost (solid), and of those that are not saturated (dotted). (b), (c) "
    f"Nominal vehicle (solid) and worst corner (dashed); a line ends where a flight is lost. {SATURATED}"
)
"""Description of the plot of :func:`draw_losses`."""


def finding(
    controller: Controller,
    x: np.ndarray,
    columns: SweepResult,
    words: str,
    *,
    digits: int = 2,
    rising: bool = True,
    nominal: bool = True,
) -> str:
    """Return in words between which points flights of a controller begin to saturate and to be lost, along ``x``.

    Args:
        controller: Controller of the sweep.
        x: Values along the sweep, increasing.
        columns: Columns of the sweep.
        words: Text around a value, with ``{}`` in its place.
        digits: Decimals of a value.
        rising: Begin at the smallest value, otherwise at the largest.
        nominal: Whether the sweep also changes the flight of the nominal vehicle.
    """
    where = lost_where(x, columns, words, digits=digits, rising=rising, nominal=nominal)
    return f"{controller.label}: {where}"


def lost_where(
    x: np.ndarray, columns: SweepResult, words: str, *, digits: int = 2, rising: bool = True, nominal: bool = True
) -> str:
    """Return the same without the controller's name."""
    order = slice(None) if rising else slice(None, None, -1)
    along = [f"{value:.{digits}f}" for value in x[order]]

    def first(name: str, begin: str, none: str) -> str:
        lost = np.array(columns[name])[order] < 1.0
        begins = np.flatnonzero(lost & ~np.concatenate(([False], lost[:-1])))
        said = (words.format(f"{along[i - 1]} and {along[i]}" if i else along[0]) for i in begins)
        where = (f"between {w}" if i else f"already at {w}" for i, w in zip(begins, said, strict=True))
        return f"{begin} {' and again '.join(where)}" if len(begins) else none

    parts = [
        first("without_limits", "saturation begins", "no flight is saturated"),
        first("finished", "losses begin", "no flight is lost"),
    ]
    if nominal and min(columns["finished"]) < 1.0:
        parts.append(first("nominal_finished", "the nominal vehicle is first lost", "the nominal vehicle is not lost"))
    return f"{', '.join(parts[:-1])}, and {parts[-1]}"
