"""Panels over time: several controllers in one panel, with uncertain and with nominal parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import to_paper
from hsv.flight.metrics import FlightData
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import GREY, letter, new_figure

_LIMITS = load_vehicle().decoupled

_FAULT: Any = {"color": GREY, "linewidth": 0.6, "linestyle": (0, (4, 3))}
_LIMIT: Any = {"color": "black", "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
_COMMAND: Any = {"color": "black", "linewidth": 0.9, "linestyle": ":"}
_THIN = 0.5
"""Width of the lines of nominal flights."""

_NEAR = 1.0 / 3.0
"""A limit is drawn if it is within this share of the panel's range from the curves, so that they stay readable."""

_OFF = 0.03
"""Share of a panel's range that is left between a limit and the panel's frame."""


@dataclass(frozen=True)
class Panel:
    """A quantity over time: axis label in the paper's unit, its SI unit, and where it is in a flight."""

    label: str
    unit: str
    value: Callable[[FlightData], np.ndarray]
    shown: tuple[float, float] | None = None
    """Range of the axis, in the paper's unit, where something runs out of it."""
    limits: tuple[float, ...] = ()
    """Limits of the quantity, SI."""


@dataclass(frozen=True)
class Curve:
    """A controller: the flight with uncertain parameters, and the one with nominal parameters."""

    label: str
    color: str
    flight: FlightData
    nominal: FlightData | None = None
    width: float = 1.1


class Zoom(NamedTuple):
    """A closer look between two times (s)."""

    start: float
    end: float
    title: str = "about the fault"


def column(index: int) -> Callable[[FlightData], np.ndarray]:
    """Return a function that returns a state of a flight."""
    return lambda flight: flight.state[:, index]


def command(index: int) -> Callable[[FlightData], np.ndarray]:
    """Return a function that returns a commanded input of a flight."""
    return lambda flight: flight.command[:, index]


ALTITUDE = Panel("$h$ (ft)", "m", column(0))
VELOCITY = Panel("$V$ (ft/s)", "m/s", column(1))
ATTITUDE = (
    Panel(r"$\alpha$ (deg)", "rad", column(2)),
    Panel(r"$\theta$ (deg)", "rad", column(3)),
    Panel("$q$ (deg/s)", "rad/s", column(4)),
)
ELASTIC = (
    Panel(r"$\eta_1$ (slug$^{1/2}$ ft)", "kg^0.5 m", column(5)),
    Panel(r"$\dot\eta_1$ (slug$^{1/2}$ ft/s)", "kg^0.5 m/s", column(6)),
    Panel(r"$\eta_2$ (slug$^{1/2}$ ft)", "kg^0.5 m", column(7)),
    Panel(r"$\dot\eta_2$ (slug$^{1/2}$ ft/s)", "kg^0.5 m/s", column(8)),
)
INPUTS = tuple(
    Panel(label, unit, command(i), limits=(float(_LIMITS.input_minimum[i]), float(_LIMITS.input_maximum[i])))
    for i, (label, unit) in enumerate(((r"$\Phi$", "1"), (r"$\delta_e$ (deg)", "rad")))
)


def in_paper_units(panel: Panel, flight: FlightData) -> np.ndarray:
    """Return a quantity of a flight in the paper's unit."""
    return np.asarray(to_paper(1.0, panel.unit)[0] * panel.value(flight))


def histories(
    panels: Sequence[Panel],
    curves: Sequence[Curve],
    *,
    zoom: Zoom | None = None,
    reference: bool = False,
    nominal_apart: bool = False,
    height: float = 2.0,
) -> Figure:
    """Return a figure with one row per panel, over the whole flight and enlarged; all samples are drawn.

    Args:
        panels: Panels to show.
        curves: Controllers to show, the last one on top.
        zoom: Range of an additional, enlarged column.
        reference: Whether the panels are altitude and velocity, with their commands.
        nominal_apart: Show nominal flights in a column of their own, if vibration would hide them; otherwise they are
            thin lines on top.
        height: Height of a row, inches.
    """
    columns = _columns(zoom, nominal_apart)
    figure = new_figure(height * len(panels) + 0.5)
    ratios = [column.width for column in columns]
    grid = figure.subplots(len(panels), len(columns), squeeze=False, width_ratios=ratios)
    limited = False
    for row, panel in zip(grid, panels, strict=True):
        if nominal_apart:
            row[1].sharey(row[0])
        for axis, column in zip(row, columns, strict=True):
            limited |= _panel(axis, panel, curves, column, reference)
        row[0].set_ylabel(panel.label)
    letter(grid[:, 0])
    for axis, column in zip(grid[0], columns, strict=True):
        axis.set_title(column.title, loc="center")
    for axis in grid[-1]:
        axis.set_xlabel("Time (s)")
    handles = _legend(curves, reference, thin=not nominal_apart, limited=limited)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)), frameon=False)
    return figure


class _Column(NamedTuple):
    """Contents of a column: flights with uncertain or nominal parameters or both, and the time range."""

    title: str
    width: float
    window: Zoom | None
    uncertain: bool
    nominal: bool


def _columns(zoom: Zoom | None, nominal_apart: bool) -> list[_Column]:
    if not nominal_apart:
        whole = [_Column("", 1.7, None, True, True)]
    else:
        whole = [
            _Column("uncertain parameters", 1.3, None, True, False),
            _Column("nominal parameters", 1.3, None, False, True),
        ]
    closer = [_Column(zoom.title, 1.0, zoom, True, not nominal_apart)] if zoom else []
    return whole + closer


def _panel(axis: Axes, panel: Panel, curves: Sequence[Curve], column: _Column, reference: bool) -> bool:
    """Draw a panel; return whether a limit is near enough to be in it."""
    for curve in curves:
        if column.uncertain:
            _line(axis, panel, curve.flight, column.window, color=curve.color, linewidth=curve.width)
        elif curve.nominal is not None:
            _line(axis, panel, curve.nominal, column.window, color=curve.color, linewidth=curve.width)
    for curve in curves:
        if column.uncertain and column.nominal and curve.nominal is not None:
            _line(axis, panel, curve.nominal, column.window, color=curve.color, linewidth=_THIN)
    first = curves[0].flight
    if reference:
        _line(axis, panel, replace(first, state=first.reference), column.window, **_COMMAND)
    if first.fault_start is not None:
        axis.axvline(first.fault_start, **_FAULT)
    (low, high), limits = axis.get_ylim(), [to_paper(limit, panel.unit)[0] for limit in panel.limits]
    margin = _NEAR * (high - low)
    near = [limit for limit in limits if column.window is None and low - margin <= limit <= high + margin]
    for limit in near:
        axis.axhline(limit, **_LIMIT)
    if near:  # keep the limit visible beside the frame
        axis.set_ylim(min(low, min(near) - _OFF * (high - low)), max(high, max(near) + _OFF * (high - low)))
    if column.window:
        axis.set_xlim(column.window.start, column.window.end)
    else:
        axis.set_xlim(0.0, max(curve.flight.time[-1] for curve in curves))
    if panel.shown and column.window is None:
        axis.set_ylim(panel.shown)
    return bool(near)


def _line(axis: Axes, panel: Panel, flight: FlightData, window: Zoom | None, **style: Any) -> None:
    inside = slice(None) if window is None else (flight.time >= window.start) & (flight.time <= window.end)
    axis.plot(flight.time[inside], in_paper_units(panel, flight)[inside], **style)


def _legend(curves: Sequence[Curve], reference: bool, *, thin: bool, limited: bool) -> list[Line2D]:
    handles = [Line2D([], [], label="command", **_COMMAND)] if reference else []
    handles += [Line2D([], [], color=c.color, linewidth=c.width, label=c.label) for c in curves]
    if thin and any(curve.nominal is not None for curve in curves):
        handles.append(Line2D([], [], color=GREY, linewidth=_THIN, label="thin: nominal parameters"))
    if curves[0].flight.fault_start is not None:
        handles.append(Line2D([], [], label="elevator fault", **_FAULT))
    if limited:
        handles.append(Line2D([], [], label="limit of the input", **_LIMIT))
    return handles
