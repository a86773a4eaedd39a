"""Figures 9 to 17: states and inputs over time, several controllers in one panel, in Case 1 and Case 2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import FOOT, to_paper
from hsv.flight.metrics import FlightData
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.figure import PaperFigure
from hsv_paper.flights import flight_of
from hsv_paper.plots import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure

LOWEST, HIGHEST = load_vehicle().decoupled.input_minimum, load_vehicle().decoupled.input_maximum
_TRAVEL = f"{np.degrees(LOWEST[1]):g} deg to {np.degrees(HIGHEST[1]):g} deg"
LIMITS = f"The limits, {LOWEST[0]:g} to {HIGHEST[0]:g} and {_TRAVEL}, are"
"""Limits of the inputs, and the beginning of a sentence on them."""

_FAULT: Any = {"color": GREY, "linewidth": 0.6, "linestyle": (0, (4, 3))}
_LIMIT: Any = {"color": "black", "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
_COMMAND: Any = {"color": "black", "linewidth": 0.9, "linestyle": ":"}
_THIN = 0.5
"""Width of the lines of nominal flights."""

_NEAR, _OFF = 1.0 / 3.0, 0.03
"""Shares of a panel's range: the distance from the curves up to which a limit is drawn, and from the frame to it."""

NOTCH = ("case1_uncertain", "case1")
NO_NOTCH = ("case1_uncertain_no_notch", "case1_no_notch")
RMPC = ("case1_uncertain_rmpc_fourth_k", "case1_rmpc_fourth_k")
RMPC_SINGLE = ("case1_uncertain_rmpc", "case1_rmpc")
CASE_1 = (*NOTCH, *NO_NOTCH, *RMPC)

ADJUSTABLE = ("case2_uncertain", "case2")
WHOLE = ("case2_uncertain_tau1", "case2_tau1")
BASELINE = ("case2_uncertain_baseline", "case2_baseline")
CASE_2 = (*ADJUSTABLE, *WHOLE, *BASELINE)

SECOND_MODE, NO_FILTER = "case1_second_mode_notch", "case1_no_notch"
"""Scenarios of Figure 13; the others are those of a controller with uncertain and with nominal parameters."""


class Panel(NamedTuple):
    """A quantity over time: axis label in the paper's unit, SI unit, and the array and the column of a flight.

    ``shown``: range of the axis in the paper's unit, if a curve leaves the panel.
    """

    label: str
    unit: str
    array: str
    column: int
    shown: tuple[float, float] | None = None


class Curve(NamedTuple):
    """A controller: its scenarios with uncertain parameters and, where it is shown, with nominal ones."""

    label: str
    color: str
    scenarios: Sequence[str]
    width: float = 1.1


class Zoom(NamedTuple):
    """An enlarged column between two times (s)."""

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
    """Return a figure with one row per panel, over the whole flight and enlarged; all samples are drawn.

    Args:
        curves: Controllers to show, the last one on top.
        zoom: Range of an additional, enlarged column, or ``None``.
        height: Height of a row, inches.
        reference: Whether the panels are altitude and velocity, with their commands.
        apart: Show nominal flights in a column of their own, if vibration would hide them; otherwise they are thin
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
    limits = False
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
            limits |= _panel(axis, panel, drawn, window, reference)
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
    if limits:
        handles.append(Line2D([], [], label="limit of the input", **_LIMIT))
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)), frameon=False)
    return figure


def _panel(
    axis: Axes, panel: Panel, drawn: Sequence[tuple[FlightData, Any]], window: Zoom | None, reference: bool
) -> bool:
    """Draw flights with their line styles; return whether a limit of the input is near enough to be in the panel."""
    unit, first = to_paper(1.0, panel.unit)[0], drawn[0][0]
    lines = [(flight.time, getattr(flight, panel.array), style) for flight, style in drawn]
    for time, values, style in [*lines, *([(first.time, first.reference, _COMMAND)] if reference else [])]:
        inside = slice(None) if window is None else (time >= window.start) & (time <= window.end)
        axis.plot(time[inside], unit * values[inside, panel.column], **style)
    if first.fault_start is not None:
        axis.axvline(first.fault_start, **_FAULT)
    if window:
        axis.set_xlim(window.start, window.end)
        return False
    axis.set_xlim(0.0, max(flight.time[-1] for flight, _ in drawn))
    low, high = axis.get_ylim()
    margin, off = _NEAR * (high - low), _OFF * (high - low)
    near = []
    if panel.array == "command":
        limits = unit * LOWEST[panel.column], unit * HIGHEST[panel.column]
        near = [limit for limit in limits if low - margin <= limit <= high + margin]
    for limit in near:
        axis.axhline(limit, **_LIMIT)
    if near:  # keep the limit visible beside the frame
        axis.set_ylim(min(low, min(near) - off), max(high, max(near) + off))
    if panel.shown:
        axis.set_ylim(panel.shown)
    return bool(near)


def _case_1(*, single: bool = False, vibrating: bool = False) -> list[Curve]:
    """Return the controllers of Figures 9 to 12; the one that rings most is drawn first and does not hide the others.

    Args:
        single: Show robust MPC with the single gain too.
        vibrating: Robust MPC rings about as much as the tube with notch: draw it last, with a thinner line.
    """
    # The curve without notch is wider, so that it stays visible where both coincide.
    without = Curve("Tube-MPC without notch", GREEN, NO_NOTCH, 2.0 if single else 1.1)
    tube = Curve("Tube-MPC with notch", BLUE, NOTCH)
    robust = [Curve("RMPC on the DM, fourth gain", ORANGE, RMPC, 0.7 if vibrating else 1.1)]
    if single:
        robust.append(Curve("RMPC on the DM, single gain", RED, RMPC_SINGLE))
    return [without, tube, *robust] if vibrating else [without, *robust, tube]


_CASE_2 = (
    Curve("baseline", ORANGE, BASELINE, 2.0),
    Curve(r"adjustable, $\tau$ = 1", GREEN, WHOLE, 1.4),
    Curve(r"adjustable, $\tau$ = 0.8", BLUE, ADJUSTABLE, 0.9),
)
"""The three controllers of Figures 14 to 17, the paper's on top."""

_SECOND_MODE = (
    Curve("Tube-MPC without notch", GREEN, [NO_FILTER]),
    Curve("Tube-MPC with notch for the second mode", BLUE, [SECOND_MODE]),
)
"""The controllers of Figure 13."""

_ELASTIC = (
    "The generalized flexible coordinates of real system in Case {}. (a) The first-order generalized flexible "
    "coordinate. (b) Derivative of the first-order generalized flexible coordinate. (c) The second-order "
    "generalized flexible coordinate. (d) Derivative of the second-order generalized flexible coordinate."
)
"""Caption of Figures 11 and 16."""

_SWITCHES = (
    "gain switches: where the nominal state enters the next smaller ellipsoid of the nested family, the nominal law of "
    "the tube controllers takes a tighter gain. The paper's law has a single gain."
)
"""The cause of kinks, dips, bursts and jumps that the paper's figures do not have."""


def _flown(case: int, nominal: str = "thin lines show") -> str:
    """Return a description of the flights of a case; ``nominal``: how those with nominal parameters are shown."""
    controllers = (
        "Robust MPC flies the decoupled model without tube and notch filter, with the fourth gain of the family, the "
        "tightest with which no corner of the bounds is lost.",
        "The ramp lasts from 20 s to 80 s; the adjustable design is flown with the paper's tau = 0.8 and with tau = 1.",
    )
    return (
        f"The flights are those of Case {case} with uncertain parameters: mass +5 %, moment of inertia -5 %, the "
        f"others at half of their bounds; {nominal} nominal parameters. The elevator effectiveness is 0.9 from 100 s "
        f"on. {controllers[case - 1]}"
    )


def figure_09() -> Figure:
    """Draw altitude and velocity; the altitude with the single gain leaves its panel."""
    top = 86480.0
    panels = ALTITUDE._replace(shown=(85450.0, top)), VELOCITY._replace(shown=(7880.0, 8190.0))
    figure = histories(panels, _case_1(single=True), None, 2.7, reference=True)
    flight = flight_of(RMPC_SINGLE[0])
    error = (flight.state[-1, 0] - flight.reference[-1, 0]) / FOOT
    leaves = flight.time[np.argmax(flight.state[:, 0] > top * FOOT)]
    arrow = {"arrowstyle": "-", "color": RED, "linewidth": 0.5}
    text, at, place = f"{error:.0f} ft above the\ncommand at 200 s", (leaves, top - 10), (leaves + 12, top - 190)
    figure.axes[0].annotate(text, at, place, color=RED, fontsize=8, arrowprops=arrow)
    return figure


FIGURES = (
    PaperFigure(
        9,
        "Trajectory in Case 1. (a) Altitude. (b) Velocity.",
        figure_09,
        _flown(1) + " The single gain of robust MPC, designed for the whole step, is also shown.",
        "Both tube controllers track through the fault; robust MPC does not.",
        "The error of robust MPC at the end depends on its gain, which the paper does not state: it is many times as "
        "large with the single gain of (32) to (35). An error of a few feet remains with the tube controllers, because "
        f"their law has no integral action. The kinks of their velocity are {_SWITCHES}",
        (*CASE_1, *RMPC_SINGLE),
    ),
    PaperFigure(
        10,
        "States in Case 1. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.",
        lambda: histories(ATTITUDE, _case_1(), Zoom(95.0, 125.0), 2.1),
        _flown(1),
        "The attitude moves at the fault and settles at the new equilibrium. The excursion is smaller with the tube "
        "than with robust MPC. The response is smoother with the notch.",
        "The size of the excursion is determined by the lost elevator and not by the notch, which removes the ringing "
        f"that follows. The dips of the tube controllers before the fault are {_SWITCHES}",
        CASE_1,
    ),
    PaperFigure(
        11,
        _ELASTIC.format(1),
        lambda: histories(ELASTIC, _case_1(vibrating=True), Zoom(99.0, 107.0), 1.9, apart=True),
        _flown(1, "the middle column shows"),
        "The coordinates vibrate at the fault. With the notch, they soon return to rest; without it, they still ring "
        "at the end.",
        "Without the notch, the second mode already grows before the fault with these parameters; the fault lowers the "
        "loop gain and thereby reduces the vibration. Robust MPC does not vibrate a lot more than the tube "
        "controllers: it flies the decoupled model, which feeds no vibration back. Only its coordinates move far, with "
        f"the angle of attack. The bursts of the tube controllers before the fault are {_SWITCHES}",
        CASE_1,
    ),
    PaperFigure(
        12,
        "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.",
        lambda: histories(INPUTS, _case_1(), Zoom(98.0, 118.0), 2.3),
        f"{_flown(1)} {LIMITS} drawn where they are near the curves.",
        "The inputs stay within their limits and are never saturated.",
        "The tube controllers stay far from the limits, so the figure says little about their behaviour at the limits. "
        "Robust MPC does not: at the step it comes close to both. Without the notch, the vibration appears in the "
        f"elevator. The jumps in the inputs of the tube controllers are {_SWITCHES}",
        CASE_1,
    ),
    PaperFigure(
        13,
        "Derivative of the generalized flexible coordinates of nominal system in the case of notch filter for the "
        "second-order flexible mode. (a) Derivative of the first-order generalized flexible coordinate. (b) Derivative "
        "of the second-order generalized flexible coordinate.",
        lambda: histories((ELASTIC[1], ELASTIC[3]), _SECOND_MODE, Zoom(99.0, 107.0), 2.3),
        'The parameters are nominal, which is our interpretation of the paper\'s "nominal system", and the fault '
        "occurs. The notch is at the frequency of the second coupled mode.",
        "The second rate decays much sooner.",
        "The first rate decays much sooner, too, which is more than the slight effect that the paper describes: a "
        "filter with such wide poles also reduces the pitch rate at the first mode.",
        (SECOND_MODE, NO_FILTER),
    ),
    PaperFigure(
        14,
        "Trajectory in case 2. (a) altitude. (b) Velocity.",
        lambda: histories(
            (ALTITUDE, VELOCITY), _CASE_2, Zoom(78.0, 130.0, "end of the ramp, and the fault"), 2.6, reference=True
        ),
        _flown(2),
        "The ramp is tracked through the fault.",
        "The paper says that the adjustable scheme responds faster in velocity. Along a ramp this cannot be seen: the "
        "velocity error is larger with tau = 0.8. The relaxed bounds of K' make the velocity response faster on a "
        "step; the ramp does not need them. The length of the ramp is our choice; the paper gives none.",
        CASE_2,
    ),
    PaperFigure(
        15,
        "States in Case 2. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.",
        lambda: histories(ATTITUDE, _CASE_2, Zoom(95.0, 125.0), 2.1),
        _flown(2),
        "The attitude moves at the fault and settles.",
        "With tau = 1 and with the baseline it moves less: this is the price of tau = 0.8. The attitude also moves "
        "when the ramp begins and when it ends, because the reference starts and stops climbing within one step.",
        CASE_2,
    ),
    PaperFigure(
        16,
        _ELASTIC.format(2),
        lambda: histories(ELASTIC, _CASE_2, Zoom(99.0, 107.0), 1.9, apart=True),
        _flown(2, "the middle column shows"),
        "The coordinates vibrate at the fault and soon return to rest.",
        "The same is true with tau = 1 and with the baseline: all three fly with the notch filter, without which the "
        "vibration continues in Case 1 (Figure 11).",
        CASE_2,
    ),
    PaperFigure(
        17,
        "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.",
        lambda: histories(INPUTS, _CASE_2, Zoom(98.0, 118.0), 2.3),
        f"{_flown(2)} {LIMITS} outside the range of the panels.",
        "The inputs stay within a reasonable range and are never saturated.",
        "With tau = 0.8, the elevator responds later to the fault. The jumps of the fuel ratio at 20 s and 80 s come "
        "from the climbing trim: the climb and the acceleration of the reference start and stop within one step.",
        CASE_2,
    ),
)
"""Figures 9 to 17."""
