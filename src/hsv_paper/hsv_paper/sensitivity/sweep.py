"""The controllers that the studies compare; sweeps of their flights, with the plots and table cells of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import to_paper
from hsv.certificate.loops import Feedback
from hsv.control.design import ControlDesign
from hsv.control.design_file import find_design, read_parameters
from hsv.flight.assembly import assemble, scenario_parameters
from hsv.flight.metrics import METRICS
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import VehicleParameters
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Point, Table, fly_over
from hsv_paper.plots import BLUE, GREEN, ORANGE, PURPLE, RED, letter, plain_log
from hsv_paper.study import Scope

Columns = dict[str, np.ndarray]
"""Arrays of one controller by name, with one element per point of a sweep."""

SATURATED_STEPS = 50
"""A flight whose command is limited in more steps than these, one second, counts as saturated."""

LOSSES = "(a) Share of the flights that are not lost (solid), and of those that are not saturated (dotted)."
"""Caption of panel (a) of :func:`draw_losses`."""


@dataclass(frozen=True)
class Controller:
    """A scenario with a design and changed parameters, and its label and colour in the plots."""

    label: str
    scenario: str
    color: str
    design: str = "baseline"
    changes: tuple[tuple[str, Any], ...] = ()

    def parameters(self) -> dict[str, Any]:
        """Return the flat parameters of the flight."""
        return {
            **(read_parameters(find_design(self.design)) if self.design else {}),
            **scenario_parameters(load_scenario(self.scenario)),
            **dict(self.changes),
        }

    @cached_property
    def vehicle(self) -> VehicleParameters:
        """The nominal vehicle, with the coupling of the flight."""
        return load_vehicle().coupled(self.parameters()["vehicle.coupling"])

    @cached_property
    def loop(self) -> Feedback:
        """The state feedback of the linear loop."""
        values = self.parameters()
        design = ControlDesign.from_parameters(values)
        gain = design.adjusted_gain(design.tau)
        if values["controller"] == "robust_mpc":
            gain = design.nominal_gains[values["robust_mpc.gain_index"]]
        return Feedback(gain, tuple(assemble(values).notch_filter.sections), design.period)


_ON_CM = (("vehicle.model", "CM"),)

WITH_NOTCH = Controller("tube with notch at 15 rad/s", "case1", BLUE)
WIDER_NOTCH = Controller("tube with notch at 14 rad/s, wider", "case1", GREEN, "baseline_derived")
WITHOUT_NOTCH = Controller("tube without notch", "case1_no_notch", ORANGE)
RMPC = Controller("RMPC without notch", "case1_rmpc_fourth_k", RED, changes=_ON_CM)
RMPC_WITH_NOTCH = Controller(
    "RMPC, were it given the notch", RMPC.scenario, PURPLE, RMPC.design, (*_ON_CM, ("notch.enabled", True))
)
RMPC_DECOUPLED = Controller("RMPC as the paper flies it, on the decoupled model", RMPC.scenario, RED)

ALL = (WITH_NOTCH, WIDER_NOTCH, WITHOUT_NOTCH, RMPC, RMPC_WITH_NOTCH)


def sweep(
    scope: Scope,
    controllers: Sequence[Controller],
    values: Sequence[float],
    point: Callable[[Controller, float], Point],
) -> dict[Controller, Columns]:
    """Fly every controller at all ``values`` and return the columns of each; ``point`` gives the flights at a value."""
    results = {}
    for controller in controllers:
        tables = []
        for done, value in enumerate(values):
            scope.progress(controller.label, done, len(values))
            tables.append(fly_over(point(controller, value)))
        results[controller] = columns_of(tables)
    return results


def columns_of(tables: Sequence[Table]) -> Columns:
    """Return the columns (SI) of one controller from the tables of its flights, one table per point.

    They are shares of flights and magnitudes of metrics: nominal (NaN if lost) and worst (NaN if any flight is lost).
    """
    rows = []
    for table in tables:
        finished = table["diverged"] == 0.0
        unsaturated = finished & (table["saturated_steps"] <= SATURATED_STEPS)
        row = {"finished": finished.mean(), "nominal_finished": finished[0], "without_limits": unsaturated.mean()}
        for name in METRICS:
            values = np.where(finished, np.abs(table.get(name, np.nan)), np.nan)
            row |= {f"{name}_nominal": values[0], f"{name}_worst": values.max()}
        rows.append(row)
    return {name: np.array([row[name] for row in rows], float) for name in rows[0]}


def widths(count: int) -> np.ndarray:
    """Return line widths for curves in drawing order. Later ones are thinner, so that no curve hides another."""
    return 0.8 + 0.3 * np.arange(count)[::-1]


def draw_metric(axis: Axes, x: np.ndarray, results: Mapping[Controller, Columns], name: str, label: str) -> None:
    """Draw a metric of every controller in the paper's unit, solid for the nominal vehicle and dashed for the worst."""
    factor = to_paper(1.0, METRICS[name].unit)[0]
    for (controller, columns), width in zip(results.items(), widths(len(results)), strict=True):
        for suffix, style in (("nominal", "-"), ("worst", "--")):
            axis.plot(x, factor * columns[f"{name}_{suffix}"], style, color=controller.color, linewidth=width)
    axis.set_ylabel(label)


def draw_losses(figure: Figure, x: np.ndarray, results: Mapping[Controller, Columns], label: str) -> np.ndarray:
    """Draw three panels over ``x`` and return them: losses and saturation, attitude excursion, altitude end error."""
    axes = np.asarray(figure.subplots(3, 1, sharex=True))
    for (controller, columns), width in zip(results.items(), widths(len(results)), strict=True):
        for name, style, key in (("finished", "-", controller.label), ("without_limits", ":", None)):
            axes[0].plot(x, 100.0 * columns[name], style, color=controller.color, linewidth=width, label=key)
    axes[0].set(ylabel="flights (%)", ylim=(-5.0, 105.0))
    draw_metric(axes[1], x, results, "post_fault_attitude_deviation", "attitude excursion (deg)")
    draw_metric(axes[2], x, results, "altitude_end_error", "altitude error at end (ft)")
    for axis in axes[1:]:
        plain_log(axis)
    axes[2].set_xlabel(label)
    letter(axes)
    legend(figure, shares=True)
    return axes


def legend(figure: Figure, *, shares: bool) -> None:
    """Add a legend of controllers and line styles; ``shares``: also for the shares of flights in panel (a)."""
    controllers, _ = figure.axes[0].get_legend_handles_labels()
    nominal = "nominal vehicle; (a): flown to the end" if shares else "nominal vehicle"
    styles: Any = {"-": nominal, "--": "worst corner"} | ({":": "(a): not a second at the limits"} if shares else {})
    keys = [Line2D([], [], color="black", linestyle=style, linewidth=0.9, label=styles[style]) for style in styles]
    figure.legend(handles=[*controllers, *keys], loc="outside upper center", ncols=3, frameon=False)


def lost_where(x: np.ndarray, columns: Columns, digits: int = 2, *, rising: bool = True) -> dict[str, str]:
    """Return table cells: the intervals of ``x`` in which saturation, losses and the nominal vehicle's loss begin.

    ``x`` increases; the search goes from its smallest value up, or from its largest down. ``digits`` are decimals.
    """
    order = slice(None) if rising else slice(None, None, -1)
    along, cells = [f"{value:.{digits}f}" for value in x[order]], {}
    for what, name in (
        ("saturation begins", "without_limits"),
        ("losses begin", "finished"),
        ("nominal vehicle lost", "nominal_finished"),
    ):
        lost = columns[name][order] < 1.0
        begins = np.flatnonzero(lost & ~np.concatenate(([False], lost[:-1])))
        cells[what] = ", ".join(f"{along[i - 1]} to {along[i]}" if i else f"at {along[0]}" for i in begins) or "–"
    return cells
