"""Figure 6: states with and without notch filter in the invariant set at the same instants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from hsv.base.units import to_paper
from hsv.control.design import TubeSet
from hsv.flight.metrics import FlightData
from hsv.model.signals import N_RIGID
from hsv_paper.figures import case1
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.style import BLUE, GREEN, GREY, letter, new_figure

INSTANTS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Seconds after the fault; the same for both flights."""

SIZE = 120.0
"""Points: about the side of a panel."""


class Plane(NamedTuple):
    """Two rigid states, axis label and SI unit of each; names of points go right (1) or left (-1) of their path."""

    i: int
    j: int
    i_label: str
    i_unit: str
    j_label: str
    j_unit: str
    side: float


PLANES = (
    Plane(0, 1, r"$e_h$ (ft)", "m", r"$e_V$ (ft/s)", "m/s", -1.0),
    Plane(2, 3, r"$e_\alpha$ (deg)", "rad", r"$e_\theta$ (deg)", "rad", 1.0),
    Plane(3, 4, r"$e_\theta$ (deg)", "rad", "$e_q$ (deg/s)", "rad/s", -1.0),
)


def steps(flight: FlightData, instants: Sequence[float]) -> np.ndarray:
    """Return the steps of a flight nearest to these seconds after its fault."""
    assert flight.fault_start is not None
    return np.abs(flight.time[:, None] - flight.fault_start - np.asarray(instants)).argmin(axis=0)


def tube_error(flight: FlightData) -> np.ndarray:
    """Return e = x - x_r - x_n (n, 5) of the rigid states."""
    return (flight.state - flight.reference - flight.deviation)[:, :N_RIGID]


def rigid_level(tube: TubeSet, error: np.ndarray) -> np.ndarray:
    """Return (n) the level of the rigid errors (n, 5) in the set's shadow on the rigid states: at most 1 in it.

    The set holds filter states too; without a filter in the loop there are none, and the shadow is what both share.
    """
    shape = np.linalg.inv(np.linalg.inv(tube.shape)[:N_RIGID, :N_RIGID])
    offset = error - tube.centre[:N_RIGID]
    return np.asarray(np.einsum("ki,ij,kj->k", offset, shape, offset))


def draw(material: Material) -> Drawing:
    """Draw three planes of the set, whole and about the states, there with instants; below, levels over time."""
    tube = material.design("baseline").flown.tube
    assert tube is not None
    flights = {
        "Tube-MPC without notch": (GREEN, "s", material.flights[case1.NO_NOTCH[0]]),
        "Tube-MPC with notch": (BLUE, "o", material.flights[case1.NOTCH[0]]),
    }
    errors = [tube_error(flight)[steps(flight, INSTANTS)] for _, _, flight in flights.values()]
    figure = new_figure(7.4)
    grid = figure.subplots(3, 3)
    for (whole, near), plane in zip(grid[:2].T, PLANES, strict=True):
        for axis in (whole, near):
            _shadow(axis, tube, plane)
            axis.set_xlabel(plane.i_label)
            axis.set_ylabel(plane.j_label)
        for (color, marker, _), error in zip(flights.values(), errors, strict=True):
            x, y = _scaled(error[:, plane.i], plane.i_unit), _scaled(error[:, plane.j], plane.j_unit)
            style = {"color": color, "marker": marker, "markerfacecolor": "none"}
            whole.plot(x, y, linestyle="", markersize=2.5, markeredgewidth=0.7, **style)
            near.plot(x, y, markersize=3.5, linewidth=0.6, **style)
        _window(near, errors, plane)
        _name(near, x, y, plane.side)
    for axis in grid[2]:
        axis.remove()
    level = figure.add_subplot(grid[2, 0].get_gridspec()[2, :])
    worst = {}
    for label, (color, marker, flight) in flights.items():
        values = rigid_level(tube, tube_error(flight))
        worst[label] = float(values.max())
        level.plot(flight.time, values, color=color, linewidth=0.9)
        level.plot([], [], color=color, marker=marker, markersize=3.5, markerfacecolor="none", label=label)
    level.plot([], [], color="black", linewidth=1.0, label="invariant set (level 1)")
    level.plot([], [], "+", color=GREY, label="its centre")
    level.set_yscale("log")
    level.set_ylim(1e-3, 2.0)
    level.axhline(1.0, color="black", linewidth=1.0)
    level.set_xlim(95.0, 130.0)
    level.set_xlabel("Time (s)")
    level.set_ylabel("level of $e - c$")
    handles, labels = level.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, frameon=False)
    letter((*grid[0], level))
    for axis in grid[1]:
        axis.set_title("enlarged", loc="left")
    closer = int(np.count_nonzero(np.abs(errors[1][:, 4]) < np.abs(errors[0][:, 4])))
    sizes = [_size(flight) for _, _, flight in flights.values()]
    return Drawing(
        figure,
        f"The errors e = x - x_r - x_n with uncertain parameters are shown at the same {len(INSTANTS)} instants, which "
        "are labelled with the seconds since the fault where there is space, in three projections of the certified "
        "ellipsoid. The last panel shows the level of the rigid-body errors in the projected ellipsoid over time. The "
        "level measures the distance from the centre c, to which half of the lost elevator shifts the errors, so that "
        "the fault brings them closer to it.",
        "The rigid-body errors stay inside the set, both with the notch (largest level "
        f"{worst['Tube-MPC with notch']:.2f}) and without it ({worst['Tube-MPC without notch']:.2f}). The "
        f"pitch-rate error is smaller with the notch at {closer} of the {len(INSTANTS)} instants.",
        "The statement that the states are closer to the nominal trajectory with the notch is true of the pitch rate, "
        "in which the vibration is visible (its root-mean-square error over the 20 s after the fault is "
        f"{sizes[0] / sizes[1]:.2f} times as large without the notch). It is hardly true of the other states, which "
        "are determined by the lost elevator and the parameters. The set is certified for the loop with the notch; "
        "without the notch, the figure is no proof.",
    )


def _scaled(values: np.ndarray, unit: str) -> np.ndarray:
    return values * to_paper(1.0, unit)[0]


def _shadow(axis: Axes, tube: TubeSet, plane: Plane) -> None:
    i, j = plane.i, plane.j
    covariance = np.linalg.inv(tube.shape)[np.ix_([i, j], [i, j])]
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    circle = np.linalg.cholesky(covariance) @ np.vstack((np.cos(angle), np.sin(angle)))
    x, y = _scaled(circle[0] + tube.centre[i], plane.i_unit), _scaled(circle[1] + tube.centre[j], plane.j_unit)
    axis.plot(x, y, color="black", linewidth=1.0)
    axis.fill(x, y, color=GREY, alpha=0.08, linewidth=0.0)
    axis.plot(_scaled(tube.centre[i], plane.i_unit), _scaled(tube.centre[j], plane.j_unit), "+", color=GREY)


def _window(axis: Axes, errors: list[np.ndarray], plane: Plane) -> None:
    for column, unit, setter in ((plane.i, plane.i_unit, axis.set_xlim), (plane.j, plane.j_unit, axis.set_ylim)):
        values = _scaled(np.concatenate([error[:, column] for error in errors]), unit)
        margin = 0.15 * np.ptp(values)
        setter(values.min() - margin, values.max() + margin)


def _name(axis: Axes, x: np.ndarray, y: np.ndarray, side: float) -> None:
    """Write beside the points of a path how long after the fault they are (s), where names have room."""
    sizes = [SIZE / np.ptp(limits) for limits in (axis.get_xlim(), axis.get_ylim())]
    points = np.column_stack((x, y)) * sizes
    ahead = np.gradient(points, axis=0)
    offsets = side * 11.0 * np.column_stack((ahead[:, 1], -ahead[:, 0])) / np.linalg.norm(ahead, axis=1)[:, None]
    named: list[np.ndarray] = []
    style: Any = {"fontsize": 7, "ha": "center", "va": "center"}
    halo = [withStroke(linewidth=2.0, foreground="white")]
    for since, right, up, offset, place in zip(INSTANTS, x, y, offsets, points + offsets, strict=True):
        if all(np.any(np.abs(place - other) > (20.0, 9.0)) for other in named):
            at, text = (right, up), (float(offset[0]), float(offset[1]))
            axis.annotate(f"{since:g} s", at, text, textcoords="offset points", path_effects=halo, **style)
            named.append(place)


def _size(flight: FlightData) -> float:
    """Return the root mean square of the pitch-rate error (rad/s) over the 20 s after the fault."""
    window = slice(*steps(flight, (0.0, 20.0)))
    return float(np.sqrt(np.mean(tube_error(flight)[window, 4] ** 2)))


FIGURE = PaperFigure(
    6, "The state of system in the mRPI set at the same time.", draw, (case1.NOTCH[0], case1.NO_NOTCH[0])
)
