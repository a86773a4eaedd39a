"""Strips of flights: every controller over one quantity, nominal vehicle and corners."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.study.corner_flights import Table
from hsv.study.sensitivity.controllers import Controller
from hsv.units import to_paper

Strip = dict[str, list[float]]
"""Columns over the points of a strip, by name."""

_METRICS = (
    "post_fault_attitude_deviation",
    "post_fault_attitude_from_nominal",
    "altitude_end_error",
    "altitude_error_maximum",
    "velocity_error_maximum",
    "elastic_decay_time",
    "fuel_equivalence_ratio_maximum",
)

SATURATED_STEPS = 50
"""Limited steps, one second, from which a flight counts as at its limits."""


def strip(tables: Sequence[Table]) -> Strip:
    """Return the columns of one controller from the table of each point; the nominal vehicle is the first flight.

    Angles in rad, lengths in m, times in s. What a lost flight does not define is not a number, and infinite at worst.
    """
    columns: Strip = {"finished": [], "without_limits": [], "nominal_finished": []}
    for table in tables:
        finished = table["diverged"] == 0.0
        columns["finished"].append(float(finished.mean()))
        columns["nominal_finished"].append(float(finished[0]))
        columns["without_limits"].append(float((finished & (table["saturated_steps"] <= SATURATED_STEPS)).mean()))
    for name in _METRICS:
        rows = [np.abs(table[name]) if name in table else np.full(len(table["diverged"]), np.nan) for table in tables]
        rows = [np.where(table["diverged"] == 0.0, row, np.nan) for table, row in zip(tables, rows, strict=True)]
        columns[f"{name}_nominal"] = [float(row[0]) for row in rows]
        columns[f"{name}_worst"] = [float(np.max(row)) if not np.isnan(row).any() else np.nan for row in rows]
    return columns


def draw_metric(axis: Axes, x: np.ndarray, strips: dict[Controller, Strip], name: str, unit: str, label: str) -> None:
    """Draw a metric of every controller: solid the nominal vehicle, dashed the worst."""
    factor = to_paper(1.0, unit)[0]
    for controller, columns in strips.items():
        for suffix, style, width in (("nominal", "-", 1.2), ("worst", "--", 0.9)):
            values = factor * np.array(columns[f"{name}_{suffix}"])
            axis.plot(x, values, style, color=controller.color, linewidth=width)
    axis.set_ylabel(label)


def draw_share(axis: Axes, x: np.ndarray, strips: dict[Controller, Strip]) -> None:
    """Draw the share of flights that come to their end (solid), and without being at their limits (dotted)."""
    for controller, columns in strips.items():
        axis.plot(x, 100.0 * np.array(columns["finished"]), color=controller.color, label=controller.label)
        axis.plot(x, 100.0 * np.array(columns["without_limits"]), ":", color=controller.color, linewidth=1.2)
    axis.set_ylabel("flights (%)")
    axis.set_ylim(-5.0, 105.0)


def legend(figure: Figure, *, shares: bool) -> None:
    """Put the controllers and what the line styles mean above the panels; ``shares``: one panel is of shares."""
    controllers, _ = figure.axes[0].get_legend_handles_labels()
    styles = {"-": "nominal vehicle", "--": "worst corner"}
    if shares:
        styles["-"] = "nominal vehicle; (a): flown to the end"
        styles[":"] = "(a): not a second at the limits"
    keys = [Line2D([], [], color="black", linestyle=s, linewidth=0.9, label=text) for s, text in styles.items()]  # type: ignore[arg-type]
    figure.legend(handles=[*controllers, *keys], loc="outside upper center", ncols=3, frameon=False)


def finding(
    controller: Controller,
    x: np.ndarray,
    columns: Strip,
    say: Callable[[float], str],
    *,
    rising: bool = True,
    nominal: bool = True,
) -> str:
    """Return in words where a controller first meets its limits and where it is lost, going along ``x``.

    Args:
        controller: Whose strip it is.
        x: Values along the strip, increasing.
        columns: The strip.
        say: Makes words of a value.
        rising: Go from the least value on, else from the largest.
        nominal: Whether the strip changes the nominal vehicle's flight, too.
    """
    order = slice(None) if rising else slice(None, None, -1)
    along = x[order]

    def first(name: str) -> str:
        lost = np.flatnonzero(np.array(columns[name])[order] < 1.0)
        return f"at {say(float(along[lost[0]]))}" if len(lost) else "nowhere"

    lost = f"{controller.label}: at its limits first {first('without_limits')}, a first flight lost {first('finished')}"
    return f"{lost}, the nominal vehicle {first('nominal_finished')}" if nominal else lost
