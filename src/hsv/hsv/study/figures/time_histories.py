"""Panels over time: several controllers laid over one another, uncertain parameters thick, nominal ones thin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.simulation.metrics import FlightData
from hsv.study.figures.style import GREY, letter, new_figure
from hsv.units import to_paper

_EVERY = 2
"""Samples from one drawn point to the next: eight points to a period of the second elastic mode."""


@dataclass(frozen=True)
class Panel:
    """A quantity over time: axis label in the paper's unit, its SI unit, and where it is in a flight."""

    label: str
    unit: str
    value: Callable[[FlightData], np.ndarray]
    limits: tuple[float, float] | None = None
    """Of the axis, in the paper's unit, where something runs out of it."""


@dataclass(frozen=True)
class Curve:
    """A controller: the flight with uncertain parameters, and the one with nominal parameters."""

    label: str
    color: str
    flight: FlightData
    nominal: FlightData | None = None
    width: float = 1.1


def column(index: int) -> Callable[[FlightData], np.ndarray]:
    """Return what takes a state out of a flight."""
    return lambda flight: flight.state[:, index]


def command(index: int) -> Callable[[FlightData], np.ndarray]:
    """Return what takes an input out of a flight, as commanded."""
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
INPUTS = (Panel(r"$\Phi$", "1", command(0)), Panel(r"$\delta_e$ (deg)", "rad", command(1)))


def in_paper_units(panel: Panel, flight: FlightData) -> np.ndarray:
    """Return a quantity of a flight in the paper's unit."""
    return np.asarray(to_paper(1.0, panel.unit)[0] * panel.value(flight))


def histories(
    panels: Sequence[Panel],
    curves: Sequence[Curve],
    *,
    zoom: tuple[float, float] | None = None,
    reference: bool = False,
    height: float = 2.0,
) -> Figure:
    """Return one row a panel; beside it, with ``zoom`` (s), the same between two times.

    Args:
        panels: What to show.
        curves: Whom to show, the last one on top.
        zoom: Times from and to which a second column looks closer.
        reference: Whether the panels are altitude and velocity, with their commands.
        height: Of a row, inches.
    """
    figure = new_figure(height * len(panels) + 0.5)
    grid = figure.subplots(len(panels), 2 if zoom else 1, squeeze=False, width_ratios=(1.7, 1) if zoom else None)
    for row, panel in zip(grid, panels, strict=True):
        for axis, window in zip(row, (None, zoom), strict=False):
            _panel(axis, panel, curves, window, reference)
    letter(grid[:, 0])
    if zoom:
        grid[0, 1].set_title("about the fault", loc="left")
    for axis in grid[-1]:
        axis.set_xlabel("Time (s)")
    handles = _legend(curves, reference)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)), frameon=False)
    return figure


def _panel(axis: Axes, panel: Panel, curves: Sequence[Curve], window: tuple[float, float] | None, ref: bool) -> None:
    for curve in curves:
        if curve.nominal is not None:
            _line(axis, panel, curve.nominal, window, color=curve.color, linewidth=0.5, alpha=0.6)
    for curve in curves:
        _line(axis, panel, curve.flight, window, color=curve.color, linewidth=curve.width)
    first = curves[0].flight
    if ref:
        target = FlightData(**{**vars(first), "state": first.reference})
        _line(axis, panel, target, window, color="black", linewidth=0.9, linestyle=":")
    if first.fault_start is not None:
        axis.axvline(first.fault_start, color=GREY, linewidth=0.6, linestyle=(0, (4, 3)))
    axis.set_xlim(window or (0.0, max(curve.flight.time[-1] for curve in curves)))
    if panel.limits and window is None:
        axis.set_ylim(panel.limits)
    if window is None:
        axis.set_ylabel(panel.label)


def _line(axis: Axes, panel: Panel, flight: FlightData, window: tuple[float, float] | None, **style: Any) -> None:
    low, high = window or (-np.inf, np.inf)
    shown = np.flatnonzero((flight.time >= low) & (flight.time <= high))[::_EVERY]
    axis.plot(flight.time[shown], in_paper_units(panel, flight)[shown], **style)


def _legend(curves: Sequence[Curve], reference: bool) -> list[Line2D]:
    handles = [Line2D([], [], color="black", linestyle=":", linewidth=0.9, label="command")] if reference else []
    handles += [Line2D([], [], color=c.color, linewidth=c.width, label=c.label) for c in curves]
    if any(curve.nominal is not None for curve in curves):
        handles.append(Line2D([], [], color=GREY, linewidth=0.5, label="thin: nominal parameters"))
    if curves[0].flight.fault_start is not None:
        handles.append(Line2D([], [], color=GREY, linewidth=0.6, linestyle=(0, (4, 3)), label="elevator fault"))
    return handles
