"""Figure 6: states with and without notch filter in the invariant set at the same instants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from hsv.control.design import TubeSet
from hsv.flight.metrics import FlightData
from hsv.model.signals import N_RIGID
from hsv_paper.designs import tube_of
from hsv_paper.figures.figure import paper_figure
from hsv_paper.flights import Flights, flight_measures
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, GREY, letter, new_figure
from hsv_paper.study import Outcome

WITH, WITHOUT = "case1_uncertain", "case1_uncertain_no_notch"

INSTANTS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Seconds after the fault; the same for both flights."""

SIZE = 120.0
"""Points: about the side of a panel."""


class Plane(NamedTuple):
    """Two rigid states with axis labels and factors to the paper's units; labels right (1) or left (-1) of a path."""

    states: tuple[int, int]
    labels: tuple[str, str]
    factors: np.ndarray
    side: float


PLANES = (
    Plane((0, 1), (r"$e_h$ (ft)", r"$e_V$ (ft/s)"), np.array([FEET, FEET]), -1.0),
    Plane((2, 3), (r"$e_\alpha$ (deg)", r"$e_\theta$ (deg)"), np.array([DEGREES, DEGREES]), 1.0),
    Plane((3, 4), (r"$e_\theta$ (deg)", "$e_q$ (deg/s)"), np.array([DEGREES, DEGREES]), -1.0),
)


def steps(flight: FlightData, instants: Sequence[float]) -> np.ndarray:
    """Return the steps of a flight nearest to these seconds after its fault."""
    assert flight.fault_start is not None
    return np.abs(flight.time[:, None] - flight.fault_start - np.asarray(instants)).argmin(axis=0)


def tube_error(flight: FlightData) -> np.ndarray:
    """Return e = x - x_r - x_n (n, 5) of the rigid states."""
    return (flight.state - flight.reference - flight.deviation)[:, :N_RIGID]


def rigid_level(tube: TubeSet, error: np.ndarray) -> np.ndarray:
    """Return (n) the level of the rigid errors (n, 5) in the set's projection on the rigid states: inside, at most 1.

    The set includes filter states; a loop without filter has none, and both share the projection.
    """
    shape = np.linalg.inv(np.linalg.inv(tube.shape)[:N_RIGID, :N_RIGID])
    offset = error - tube.centre[:N_RIGID]
    return np.asarray(np.einsum("ki,ij,kj->k", offset, shape, offset))


@paper_figure(6, "The state of system in the mRPI set at the same time.", WITH, WITHOUT)
def figure_06(flights: Flights) -> Outcome:
    """Draw three projections of the set, whole and enlarged about the states; below, levels over time."""
    tube = tube_of("baseline")
    shown = (("Tube-MPC without notch", GREEN, "s", WITHOUT), ("Tube-MPC with notch", BLUE, "o", WITH))
    errors = [tube_error(flights[name])[steps(flights[name], INSTANTS)] for *_, name in shown]
    figure = new_figure(7.4)
    grid = figure.subplots(3, 3)
    for (whole, near), plane in zip(grid[:2].T, PLANES, strict=True):
        for axis in (whole, near):
            _projection(axis, tube, plane)
        for (_, color, marker, _), error in zip(shown, errors, strict=True):
            x, y = (error[:, plane.states] * plane.factors).T
            style = {"color": color, "marker": marker, "markerfacecolor": "none"}
            whole.plot(x, y, linestyle="", markersize=2.5, markeredgewidth=0.7, **style)
            near.plot(x, y, markersize=3.5, linewidth=0.6, **style)
        values = np.concatenate(errors)[:, plane.states] * plane.factors
        low, high, margin = values.min(axis=0), values.max(axis=0), 0.15 * np.ptp(values, axis=0)
        xlim, ylim = np.transpose((low - margin, high + margin))
        near.set(xlim=xlim, ylim=ylim)
        _label_instants(near, x, y, plane.side)
    for axis in grid[2]:
        axis.remove()
    level = figure.add_subplot(grid[2, 0].get_gridspec()[2, :])
    worst = {}
    for label, color, marker, name in shown:
        values = rigid_level(tube, tube_error(flights[name]))
        worst[name] = float(values.max())
        level.plot(flights[name].time, values, color=color, linewidth=0.9)
        level.plot([], [], color=color, marker=marker, markersize=3.5, markerfacecolor="none", label=label)
    level.plot([], [], color="black", linewidth=1.0, label="invariant set (level 1)")
    level.plot([], [], "+", color=GREY, label="its centre")
    level.axhline(1.0, color="black", linewidth=1.0)
    level.set(yscale="log", ylim=(1e-3, 2.0), xlim=(95.0, 130.0), xlabel="Time (s)", ylabel="level of $e - c$")
    figure.legend(*level.get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)
    letter((*grid[0], level))
    for axis in grid[1]:
        axis.set_title("enlarged", loc="left")
    closer = int(np.count_nonzero(np.abs(errors[1][:, 4]) < np.abs(errors[0][:, 4])))
    without, with_ = (flight_measures(flights[name])["pitch_rate_error"] for *_, name in shown)
    return Outcome(
        figure,
        f"The errors e = x - x_r - x_n with uncertain parameters are shown at the same {len(INSTANTS)} instants, which "
        "are labelled with the seconds since the fault where there is space, in three projections of the certified "
        "ellipsoid. The last panel shows the level of the rigid-body errors in the projected ellipsoid over time. The "
        "level measures the distance from the centre c, to which half of the lost elevator shifts the errors, so that "
        "the fault brings them closer to it.",
        f"The rigid-body errors stay inside the set, both with the notch (largest level {worst[WITH]:.2f}) and without "
        f"it ({worst[WITHOUT]:.2f}). The pitch-rate error is smaller with the notch at {closer} of the {len(INSTANTS)} "
        "instants.",
        "The statement that the states are closer to the nominal trajectory with the notch is true of the pitch rate, "
        "in which the vibration is visible (its root-mean-square error over the 20 s after the fault is "
        f"{without / with_:.2f} times as large without the notch). It is hardly true of the other states, which "
        "are determined by the lost elevator and the parameters. The set is certified for the loop with the notch; "
        "without the notch, the figure is no proof.",
    )


def _projection(axis: Axes, tube: TubeSet, plane: Plane) -> None:
    """Draw the boundary of the set's projection on a plane, its interior and its centre."""
    covariance = np.linalg.inv(tube.shape)[np.ix_(plane.states, plane.states)]
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    circle = np.linalg.cholesky(covariance) @ np.vstack((np.cos(angle), np.sin(angle)))
    centre = tube.centre[list(plane.states)] * plane.factors
    x, y = circle * plane.factors[:, None] + centre[:, None]
    axis.plot(x, y, color="black", linewidth=1.0)
    axis.fill(x, y, color=GREY, alpha=0.08, linewidth=0.0)
    axis.plot(*centre, "+", color=GREY)
    axis.set(xlabel=plane.labels[0], ylabel=plane.labels[1])


def _label_instants(axis: Axes, x: np.ndarray, y: np.ndarray, side: float) -> None:
    """Label the points of a path with their seconds after the fault where the labels do not overlap."""
    sizes = [SIZE / np.ptp(limits) for limits in (axis.get_xlim(), axis.get_ylim())]
    points = np.column_stack((x, y)) * sizes
    ahead = np.gradient(points, axis=0)
    offsets = side * 11.0 * np.column_stack((ahead[:, 1], -ahead[:, 0])) / np.linalg.norm(ahead, axis=1)[:, None]
    labelled: list[np.ndarray] = []
    style: Any = {"fontsize": 7, "ha": "center", "va": "center", "textcoords": "offset points"}
    halo = [withStroke(linewidth=2.0, foreground="white")]
    for since, right, up, offset, place in zip(INSTANTS, x, y, offsets, points + offsets, strict=True):
        if all(np.any(np.abs(place - other) > (20.0, 9.0)) for other in labelled):
            at, text = (right, up), (float(offset[0]), float(offset[1]))
            axis.annotate(f"{since:g} s", at, text, path_effects=halo, **style)
            labelled.append(place)
