"""Figures 9 to 17: states and inputs over time in Case 1 and Case 2, several controllers in each panel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import FOOT, to_paper
from hsv.flight.metrics import FlightData
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import flight_of
from hsv_paper.plots import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure

_FAULT: Any = {"color": GREY, "linewidth": 0.6, "linestyle": (0, (4, 3))}
_LIMIT: Any = {"color": "black", "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
_COMMAND: Any = {"color": "black", "linewidth": 0.9, "linestyle": ":"}
_THIN = 0.5
"""Width of the lines of flights with nominal parameters."""

NOTCH = ("case1_uncertain", "case1")
NO_NOTCH = ("case1_uncertain_no_notch", "case1_no_notch")
RMPC = ("case1_uncertain_rmpc_fourth_k", "case1_rmpc_fourth_k")
RMPC_SINGLE = ("case1_uncertain_rmpc", "case1_rmpc")
ADJUSTABLE = ("case2_uncertain", "case2")
WHOLE = ("case2_uncertain_tau1", "case2_tau1")
BASELINE = ("case2_uncertain_baseline", "case2_baseline")
"""The scenarios of each controller: first with uncertain parameters, then with nominal ones."""


class Panel(NamedTuple):
    """A quantity over time: axis label in the paper's unit, SI unit, and the array and column of a flight's history.

    ``shown`` is the range of the axis in the paper's unit; None fits the axis to the curves.
    """

    label: str
    unit: str
    array: str
    column: int
    shown: tuple[float, float] | None = None


class Curve(NamedTuple):
    """A controller with its scenarios: only one, or two, first with uncertain, then with nominal parameters."""

    label: str
    color: str
    scenarios: Sequence[str]
    width: float = 1.1


class Zoom(NamedTuple):
    """An enlarged column of a figure: its time range (s) and its title."""

    start: float
    end: float
    title: str = "about the fault"


_STATES = (
    ("$h$ (ft)", "m"),
    ("$V$ (ft/s)", "m/s"),
    (r"$\alpha$ (deg)", "rad"),
    (r"$\theta$ (deg)", "rad"),
    ("$q$ (deg/s)", "rad/s"),
    (r"$\eta_1$ (slug$^{1/2}$ ft)", "kg^0.5 m"),
    (r"$\dot\eta_1$ (slug$^{1/2}$ ft/s)", "kg^0.5 m/s"),
    (r"$\eta_2$ (slug$^{1/2}$ ft)", "kg^0.5 m"),
    (r"$\dot\eta_2$ (slug$^{1/2}$ ft/s)", "kg^0.5 m/s"),
)
ALTITUDE, VELOCITY, *_OTHERS = (Panel(*state, "state", i) for i, state in enumerate(_STATES))
ATTITUDE, ELASTIC = _OTHERS[:3], _OTHERS[3:]
INPUTS = Panel(r"$\Phi$", "1", "command", 0), Panel(r"$\delta_e$ (deg)", "rad", "command", 1)


def histories(
    panels: Sequence[Panel],
    curves: Sequence[Curve],
    zoom: Zoom | None,
    height: float,
    *,
    reference: bool = False,
    apart: bool = False,
) -> Figure:
    """Return a figure with one row per panel: the whole flight and, next to it, ``zoom``. All samples are drawn.

    Args:
        curves: Controllers to show, the last one on top.
        zoom: Time range of an additional, enlarged column, or None.
        height: Height of a row, inches.
        reference: Whether to draw the commands; the panels must be altitude and velocity.
        apart: Draw nominal flights in a column of their own, where vibration would hide them. Otherwise they are thin
            lines on top.
    """
    # Title, width, time range, and the indices of the scenarios of each curve.
    columns: list[tuple[str, float, Zoom | None, Sequence[int]]] = [("", 1.7, None, (0, 1))]
    if apart:
        columns = [("uncertain parameters", 1.3, None, [0]), ("nominal parameters", 1.3, None, [1])]
    if zoom:
        columns.append((zoom.title, 1.0, zoom, [0] if apart else (0, 1)))
    figure = new_figure(height * len(panels) + 0.5)
    grid = figure.subplots(len(panels), len(columns), squeeze=False, width_ratios=[column[1] for column in columns])
    for row, panel in zip(grid, panels, strict=True):
        if apart:
            row[1].sharey(row[0])
        for axis, (_, _, window, indices) in zip(row, columns, strict=True):
            drawn = [
                (flight_of(curve.scenarios[index]), {"color": curve.color, "linewidth": _THIN if thin else curve.width})
                for thin, index in enumerate(indices)
                for curve in curves
                if index < len(curve.scenarios)
            ]
            _panel(axis, panel, drawn, window, reference)
        row[0].set_ylabel(panel.label)
    letter(grid[:, 0])
    for axis, column in zip(grid[0], columns, strict=True):
        axis.set_title(column[0], loc="center")
    for axis in grid[-1]:
        axis.set_xlabel("Time (s)")
    handles = [Line2D([], [], label="command", **_COMMAND)] if reference else []
    handles += [Line2D([], [], color=c.color, linewidth=c.width, label=c.label) for c in curves]
    if not apart and any(len(curve.scenarios) > 1 for curve in curves):
        handles.append(Line2D([], [], color=GREY, linewidth=_THIN, label="thin: nominal parameters"))
    handles.append(Line2D([], [], label="elevator fault", **_FAULT))
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)), frameon=False)
    return figure


def _panel(
    axis: Axes, panel: Panel, drawn: Sequence[tuple[FlightData, Any]], window: Zoom | None, reference: bool
) -> None:
    """Draw one quantity of several flights, each in its style, and the fault; ``reference``: the commands, too."""
    unit, first = to_paper(1.0, panel.unit)[0], drawn[0][0]
    lines = [(flight.time, getattr(flight.history, panel.array), style) for flight, style in drawn]
    for time, values, style in [*lines, *([(first.time, first.reference, _COMMAND)] if reference else [])]:
        inside = slice(None) if window is None else (time >= window.start) & (time <= window.end)
        axis.plot(time[inside], unit * values[inside, panel.column], **style)
    if first.fault_start is not None:
        axis.axvline(first.fault_start, **_FAULT)
    if window:
        axis.set_xlim(window.start, window.end)
        return
    axis.set_xlim(0.0, max(flight.time[-1] for flight, _ in drawn))
    if panel.shown:
        axis.set_ylim(panel.shown)


_CASE_1 = (
    Curve("Tube-MPC without notch", GREEN, NO_NOTCH),
    Curve("RMPC on the DM, fourth gain", ORANGE, RMPC),
    Curve("Tube-MPC with notch", BLUE, NOTCH),
)
"""The controllers of Figures 9 to 12; the one that vibrates most is drawn first and does not hide the others."""

_CASE_2 = (
    Curve("baseline", ORANGE, BASELINE, 2.0),
    Curve(r"adjustable, $\tau$ = 1", GREEN, WHOLE, 1.4),
    Curve(r"adjustable, $\tau$ = 0.8", BLUE, ADJUSTABLE, 0.9),
)
"""The controllers of Figures 14 to 17. The paper's own is drawn last, on top."""

_SECOND_MODE = (
    Curve("Tube-MPC without notch", GREEN, ["case1_no_notch"]),
    Curve("Tube-MPC with notch for the second mode", BLUE, ["case1_second_mode_notch"]),
)
"""The controllers of Figure 13."""


def figure_09() -> Figure:
    """Draw altitude and velocity in Case 1. With its single gain, robust MPC leaves the altitude panel."""
    without, robust, tube = _CASE_1
    # The curve without notch is wider, so that it stays visible where both coincide.
    curves = without._replace(width=2.0), robust, Curve("RMPC on the DM, single gain", RED, RMPC_SINGLE), tube
    top = 86480.0
    panels = ALTITUDE._replace(shown=(85450.0, top)), VELOCITY._replace(shown=(7880.0, 8190.0))
    figure = histories(panels, curves, None, 2.7, reference=True)
    flight = flight_of(RMPC_SINGLE[0])
    error = (flight.history.state[-1, 0] - flight.reference[-1, 0]) / FOOT
    leaves = flight.time[np.argmax(flight.history.state[:, 0] > top * FOOT)]
    arrow = {"arrowstyle": "-", "color": RED, "linewidth": 0.5}
    text, at, place = f"{error:.0f} ft above the\ncommand at 200 s", (leaves, top - 10), (leaves + 12, top - 190)
    figure.axes[0].annotate(text, at, place, color=RED, fontsize=8, arrowprops=arrow)
    return figure


def figure_11() -> Figure:
    """Draw the elastic states in Case 1; robust MPC vibrates like the tube with notch: it is drawn last and thinner."""
    without, robust, tube = _CASE_1
    return histories(ELASTIC, (without, tube, robust._replace(width=0.7)), Zoom(99.0, 107.0), 1.9, apart=True)


def figure_12() -> Figure:
    """Draw the inputs in Case 1, with both limits of the fuel equivalence ratio and the upper limit of the elevator."""
    figure = histories(INPUTS, _CASE_1, Zoom(98.0, 118.0), 2.3)
    vehicle = load_vehicle().decoupled
    fuel, _, elevator, _ = figure.axes
    fuel.axhline(vehicle.fuel_equivalence_ratio_minimum, **_LIMIT)
    fuel.axhline(vehicle.fuel_equivalence_ratio_maximum, **_LIMIT)
    elevator.axhline(to_paper(vehicle.elevator_deflection_maximum, "rad")[0], **_LIMIT)
    return figure


FIGURES: dict[int, Callable[[], Figure]] = {
    9: figure_09,
    10: lambda: histories(ATTITUDE, _CASE_1, Zoom(95.0, 125.0), 2.1),
    11: figure_11,
    12: figure_12,
    13: lambda: histories((ELASTIC[1], ELASTIC[3]), _SECOND_MODE, Zoom(99.0, 107.0), 2.3),
    14: lambda: histories(
        (ALTITUDE, VELOCITY), _CASE_2, Zoom(78.0, 130.0, "end of the ramp, and the fault"), 2.6, reference=True
    ),
    15: lambda: histories(ATTITUDE, _CASE_2, Zoom(95.0, 125.0), 2.1),
    16: lambda: histories(ELASTIC, _CASE_2, Zoom(99.0, 107.0), 1.9, apart=True),
    17: lambda: histories(INPUTS, _CASE_2, Zoom(98.0, 118.0), 2.3),
}
"""The functions that draw Figures 9 to 17, by number."""
