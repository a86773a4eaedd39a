"""Figure 6: the error with and without notch filter in the invariant set, at the same instants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hsv.control.design import TubeSet
from hsv.flight.metrics import FlightData
from hsv.model.signals import N_RIGID
from hsv_paper.designs import tube_of
from hsv_paper.flights import flight_of
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, GREY, letter, new_figure

WITH, WITHOUT = "case1_uncertain", "case1_uncertain_no_notch"

INSTANTS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Seconds after the fault at which the errors of both flights are drawn."""


class Plane(NamedTuple):
    """Indices of two rigid-body states, with their axis labels and the factors from SI to the paper's units."""

    states: tuple[int, int]
    labels: tuple[str, str]
    factors: np.ndarray


PLANES = (
    Plane((0, 1), (r"$e_h$ (ft)", r"$e_V$ (ft/s)"), np.array([FEET, FEET])),
    Plane((2, 3), (r"$e_\alpha$ (deg)", r"$e_\theta$ (deg)"), np.array([DEGREES, DEGREES])),
    Plane((3, 4), (r"$e_\theta$ (deg)", "$e_q$ (deg/s)"), np.array([DEGREES, DEGREES])),
)


def errors_at(flight: FlightData, instants: Sequence[float]) -> np.ndarray:
    """Return the errors e = x - x_r - x_n of the rigid body, shape (n, 5), at n ``instants`` (s) after the fault."""
    assert flight.fault_start is not None
    steps = np.abs(flight.time[:, None] - flight.fault_start - np.asarray(instants)).argmin(axis=0)
    return (flight.history.state - flight.reference - flight.history.deviation)[steps, :N_RIGID]


def figure_06() -> Figure:
    """Draw three projections of the invariant set, whole and enlarged, and the errors with and without notch filter."""
    tube = tube_of("baseline")
    shown = (("Tube-MPC without notch", GREEN, "s", WITHOUT), ("Tube-MPC with notch", BLUE, "o", WITH))
    figure = new_figure(5.0)
    grid = figure.subplots(2, 3)
    for (whole, near), plane in zip(grid.T, PLANES, strict=True):
        for axis in (whole, near):
            _projection(axis, tube, plane)
        values = []
        for label, color, marker, name in shown:
            values.append(errors_at(flight_of(name), INSTANTS)[:, plane.states] * plane.factors)
            style = {"color": color, "marker": marker, "markerfacecolor": "none"}
            whole.plot(*values[-1].T, linestyle="", markersize=2.5, markeredgewidth=0.7, **style)
            near.plot(*values[-1].T, markersize=3.5, linewidth=0.6, label=label, **style)
        low, high, margin = np.min(values, (0, 1)), np.max(values, (0, 1)), 0.15 * np.ptp(values, (0, 1))
        xlim, ylim = np.transpose((low - margin, high + margin))
        near.set(xlim=xlim, ylim=ylim)
        near.set_title("enlarged", loc="left")
    figure.legend(*grid[1, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)
    letter(grid[0])
    return figure


def _projection(axis: Axes, tube: TubeSet, plane: Plane) -> None:
    """Draw the projection of the invariant set on a plane: its boundary, its interior and its centre."""
    covariance = np.linalg.inv(tube.shape)[np.ix_(plane.states, plane.states)]
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    circle = np.linalg.cholesky(covariance) @ np.vstack((np.cos(angle), np.sin(angle)))
    centre = tube.centre[list(plane.states)] * plane.factors
    x, y = circle * plane.factors[:, None] + centre[:, None]
    axis.plot(x, y, color="black", linewidth=1.0, label="invariant set")
    axis.fill(x, y, color=GREY, alpha=0.08, linewidth=0.0)
    axis.plot(*centre, "+", color=GREY, label="its centre")
    axis.set(xlabel=plane.labels[0], ylabel=plane.labels[1])
