"""Figures 9 to 17: states and inputs over time, several controllers in one panel, in Case 1 and Case 2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hsv.base.units import FOOT, to_paper
from hsv.control.notch_filter import notch_response
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.metrics import METRICS, FlightData, flight_metrics
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.figure import paper_figure
from hsv_paper.flights import Flights, flight_measures
from hsv_paper.modes import elastic_modes
from hsv_paper.plots import BLUE, DEGREES, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv_paper.study import Outcome

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

Scenarios = tuple[str, str]
"""Scenarios of a controller with uncertain and with nominal parameters."""

NOTCH: Scenarios = ("case1_uncertain", "case1")
NO_NOTCH: Scenarios = ("case1_uncertain_no_notch", "case1_no_notch")
RMPC: Scenarios = ("case1_uncertain_rmpc_fourth_k", "case1_rmpc_fourth_k")
RMPC_SINGLE: Scenarios = ("case1_uncertain_rmpc", "case1_rmpc")
CASE_1 = (*NOTCH, *NO_NOTCH, *RMPC)

ADJUSTABLE: Scenarios = ("case2_uncertain", "case2")
WHOLE: Scenarios = ("case2_uncertain_tau1", "case2_tau1")
BASELINE: Scenarios = ("case2_uncertain_baseline", "case2_baseline")
CASE_2 = (*ADJUSTABLE, *WHOLE, *BASELINE)
UNCERTAIN_2 = ADJUSTABLE[0], WHOLE[0], BASELINE[0]

SECOND_MODE, NO_FILTER = "case1_second_mode_notch", "case1_no_notch"
"""Scenarios of Figure 13."""


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
    flights: Flights,
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
        flights: Gives the flights.
        panels: Panels to show.
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
                (flights[curve.scenarios[index]], {"color": curve.color, "linewidth": _THIN if thin else curve.width})
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


def _flown(case: int, nominal: str = "thin lines show") -> str:
    """Return a description of the flights of a case; ``nominal``: how those with nominal parameters are shown."""
    return f"The flights are those of [Case {case}](index.md#flights); {nominal} nominal parameters."


def measured(flights: Flights, metric: str, *scenarios: str) -> list[float]:
    """Return a metric of flights in the paper's unit."""
    return [to_paper(flight_metrics(flights[name])[metric], METRICS[metric].unit)[0] for name in scenarios]


def commands(flights: Flights, scenarios: Sequence[str]) -> np.ndarray:
    """Return all commands (n, 2) of flights: fuel equivalence ratio, elevator in deg."""
    return np.concatenate([flights[scenario].command for scenario in scenarios]) * [1.0, DEGREES]


def ranges(flights: Flights, scenarios: Sequence[str]) -> str:
    """Return the ranges of both commands over several flights, in words."""
    least, largest = (end(commands(flights, scenarios), axis=0) for end in (np.min, np.max))
    return f"{least[0]:.2f} to {largest[0]:.2f} and {least[1]:.1f} deg to {largest[1]:.1f} deg"


def limited(flights: Flights, scenarios: Sequence[str]) -> str:
    """Return in how many steps of several flights a command was saturated, in words."""
    steps = sum(int(np.any(flights[scenario].flight_curves.saturated, axis=1).sum()) for scenario in scenarios)
    return f"saturated in {steps or 'no'} step{'s' if steps > 1 else ''} of the {len(scenarios)} flights"


def gain_switches(flight: FlightData) -> np.ndarray:
    """Return the steps in which the nominal law switches to another gain of its nested family."""
    return np.flatnonzero(np.diff(flight.gain_index)) + 1


def _switches(flights: Flights) -> str:
    """Return in words the times (s) at which the tubes' nominal law switches to the next gain."""
    flight = flights[NOTCH[0]]
    *first, last = (f"{time:.0f}" for time in flight.time[gain_switches(flight)])
    return f"at {', '.join(first)} and {last} s"


def _during(flight: FlightData, start: float, end: float) -> np.ndarray:
    """Return the states (n, 9) between two times (s)."""
    return flight.state[(flight.time >= start) & (flight.time <= end)]


@paper_figure(9, "Trajectory in Case 1. (a) Altitude. (b) Velocity.", *CASE_1, *RMPC_SINGLE)
def figure_09(flights: Flights) -> Outcome:
    """Draw altitude and velocity; the altitude with the single gain leaves its panel."""
    top = 86480.0
    panels = ALTITUDE._replace(shown=(85450.0, top)), VELOCITY._replace(shown=(7880.0, 8190.0))
    figure = histories(flights, panels, _case_1(single=True), None, 2.7, reference=True)
    errors = measured(flights, "altitude_end_error", NOTCH[0], NO_NOTCH[0], RMPC[0], RMPC_SINGLE[0])
    [off] = measured(flights, "velocity_end_error", RMPC_SINGLE[0])
    flight = flights[RMPC_SINGLE[0]]
    leaves = flight.time[np.argmax(flight.state[:, 0] > top * FOOT)]
    arrow = {"arrowstyle": "-", "color": RED, "linewidth": 0.5}
    text, at, place = f"{errors[3]:.0f} ft above the\ncommand at 200 s", (leaves, top - 10), (leaves + 12, top - 190)
    figure.axes[0].annotate(text, at, place, color=RED, fontsize=8, arrowprops=arrow)
    return Outcome(
        figure,
        _flown(1) + " The single gain, designed for the whole step, is also shown.",
        f"Both tube controllers track through the fault, with an altitude error at 200 s of {errors[0]:.1f} ft with "
        f"the notch and {errors[1]:.1f} ft without it. Robust MPC does not; its error at the end is {errors[2]:.0f} "
        "ft.",
        "The error of robust MPC at the end depends on its gain, which the paper does not state: with the single gain "
        f"of (32) to (35) it is {errors[3]:.0f} ft and {off:.0f} ft/s. An error of a few feet remains with the tube "
        "controllers, because their law has no integral action. Their velocity has kinks at the "
        f"[gain switches](index.md#flights) {_switches(flights)}.",
    )


@paper_figure(10, "States in Case 1. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", *CASE_1)
def figure_10(flights: Flights) -> Outcome:
    """Draw angle of attack, pitch angle and pitch rate."""
    figure = histories(flights, ATTITUDE, _case_1(), Zoom(95.0, 125.0), 2.1)
    shown = NOTCH[0], NO_NOTCH[0], RMPC[0]
    tube, without, robust = measured(flights, "post_fault_attitude_deviation", *shown)
    rate, rate_without = (DEGREES * flight_measures(flights[name])["pitch_rate_ringing"] for name in shown[:2])
    return Outcome(
        figure,
        _flown(1),
        "The attitude moves at the fault and settles at the new equilibrium. The excursion is smaller with the tube "
        f"({tube:.2f} deg) than with robust MPC ({robust:.2f} deg). The response is smoother with the notch: between "
        f"10 s and 20 s after the fault, the peak-to-peak pitch rate is {rate:.3f} deg/s with it and "
        f"{rate_without:.3f} deg/s without it.",
        "The size of the excursion is determined by the lost elevator and not by the notch: without the notch it is "
        f"{without:.2f} deg. The notch removes the ringing that follows. The dips of the tube controllers before the "
        f"fault follow [gain switches](index.md#flights) {_switches(flights)}.",
    )


@paper_figure(
    11,
    "The generalized flexible coordinates of real system in Case 1. (a) The first-order generalized flexible "
    "coordinate. (b) Derivative of the first-order generalized flexible coordinate. (c) The second-order "
    "generalized flexible coordinate. (d) Derivative of the second-order generalized flexible coordinate.",
    *CASE_1,
)
def figure_11(flights: Flights) -> Outcome:
    """Draw both elastic coordinates with their derivatives."""
    figure = histories(flights, ELASTIC, _case_1(vibrating=True), Zoom(99.0, 107.0), 1.9, apart=True)
    with_, with_nominal, without, without_nominal = measured(flights, "elastic_decay_time", *NOTCH, *NO_NOTCH)
    unit = to_paper(1.0, "kg^0.5 m/s")[0]

    def span(scenario: str, start: float, end: float) -> float:
        """Return the peak-to-peak second rate (√slug ft/s) between two times (s)."""
        return float(unit * np.ptp(_during(flights[scenario], start, end)[:, 8]))

    def largest(start: float) -> float:
        """Return the largest second rate (√slug ft/s) of the tube with notch within 3 s of ``start`` (s)."""
        return float(unit * np.abs(_during(flights[NOTCH[0]], start, start + 3.0)[:, 8]).max())

    flight = flights[NOTCH[0]]
    bursts = [largest(flight.time[step]) for step in gain_switches(flight)]
    return Outcome(
        figure,
        _flown(1, "the middle column shows"),
        "The coordinates vibrate at the fault and return to rest. With the notch, both rates are within 5 % of their "
        f"peak after {with_:.1f} s (with nominal parameters, {with_nominal:.1f} s). Without the notch, they still ring "
        f"at the end, {without:.0f} s after the fault (with nominal parameters, they decay in {without_nominal:.0f} "
        "s).",
        "Without the notch, the second mode already grows before the fault with these parameters: its peak-to-peak "
        f"rate is {span(NO_NOTCH[0], 30.0, 40.0):.2f} √slug ft/s from 30 s to 40 s and "
        f"{span(NO_NOTCH[0], 90.0, 100.0):.2f} from 90 s to 100 s. The fault lowers the loop gain and thereby reduces "
        "the vibration. Robust MPC does not vibrate a lot more than the tube controllers: it flies the decoupled "
        "model, which feeds no vibration back (peak-to-peak second rate after the fault "
        f"{span(RMPC[0], 100.0, 200.0):.2f}, tube with notch {span(NOTCH[0], 100.0, 200.0):.2f}). Only its coordinates "
        f"move far, with the angle of attack. The bursts of the tube controllers {_switches(flights)} are "
        "[gain switches](index.md#flights), which move the elevator within one step; with the notch, the second rate "
        f"reaches {max(bursts):.2f} in them and {largest(100.0):.2f} at the fault.",
    )


@paper_figure(12, "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.", *CASE_1)
def figure_12(flights: Flights) -> Outcome:
    """Draw both inputs as commanded."""
    figure = histories(flights, INPUTS, _case_1(), Zoom(98.0, 118.0), 2.3)
    largest, flight = commands(flights, RMPC).max(axis=0), flights[NOTCH[0]]
    steps = gain_switches(flight)
    jumps = np.abs(flight.command[steps] - flight.command[steps - 1]).max(axis=0)
    return Outcome(
        figure,
        f"{_flown(1)} {LIMITS} drawn where they are near the curves.",
        f"The inputs stay within their limits and are {limited(flights, CASE_1)}. With uncertain and nominal "
        f"parameters together, the fuel ratio and the elevator range over {ranges(flights, NOTCH)} with the notch, "
        f"over {ranges(flights, NO_NOTCH)} without it, and over {ranges(flights, RMPC)} with robust MPC.",
        "The tube controllers stay far from the limits, so the figure says little about their behaviour at the limits. "
        f"Robust MPC does not: at the step it commands a fuel ratio of {largest[0]:.2f} (limit {HIGHEST[0]:g}) and an "
        f"elevator deflection of {largest[1]:.0f} deg (limit {np.degrees(HIGHEST[1]):.0f} deg). The jumps in the "
        f"inputs of the tube controllers {_switches(flights)}, of up to {jumps[0]:.2f} and {np.degrees(jumps[1]):.1f} "
        "deg, are [gain switches](index.md#flights). Without the notch, the vibration appears in the elevator.",
    )


@paper_figure(
    13,
    "Derivative of the generalized flexible coordinates of nominal system in the case of notch filter for the "
    "second-order flexible mode. (a) Derivative of the first-order generalized flexible coordinate. (b) Derivative "
    "of the second-order generalized flexible coordinate.",
    SECOND_MODE,
    NO_FILTER,
)
def figure_13(flights: Flights) -> Outcome:
    """Draw both elastic rates, with the notch at the second mode and without a notch."""
    curves = [
        Curve("Tube-MPC without notch", GREEN, [NO_FILTER]),
        Curve("Tube-MPC with notch for the second mode", BLUE, [SECOND_MODE]),
    ]
    figure = histories(flights, (ELASTIC[1], ELASTIC[3]), curves, Zoom(99.0, 107.0), 2.3)
    first, second = (measured(flights, f"elastic_rate_{mode}_decay_time", NO_FILTER, SECOND_MODE) for mode in (1, 2))
    frequencies = [mode.natural_frequency for mode in elastic_modes("paper_like").values()]
    sections = assemble(flight_parameters(load_scenario(SECOND_MODE))).notch_filter.sections
    passed = abs(notch_response(sections, np.array(frequencies))[0])
    return Outcome(
        figure,
        'The parameters are nominal, which is our interpretation of the paper\'s "nominal system", and the fault '
        f"occurs. The notch is at {sections[0].zero_frequency:g} rad/s; the second coupled mode is at "
        f"{frequencies[1]:.2f} rad/s.",
        f"The second rate decays in {second[1]:.1f} s instead of {second[0]:.1f} s.",
        f"The first rate decays in {first[1]:.1f} s instead of {first[0]:.1f} s, which is more than the slight effect "
        f"that the paper describes: a filter with such wide poles passes only {100.0 * passed:.0f} % of the pitch rate "
        "at the first mode.",
    )


@paper_figure(14, "Trajectory in case 2. (a) altitude. (b) Velocity.", *CASE_2)
def figure_14(flights: Flights) -> Outcome:
    """Draw altitude and velocity along the ramp."""
    closer = Zoom(78.0, 130.0, "end of the ramp, and the fault")
    figure = histories(flights, (ALTITUDE, VELOCITY), _CASE_2, closer, 2.6, reference=True)
    lag = measured(flights, "velocity_integral_absolute_error", *UNCERTAIN_2)
    [largest], [last] = (measured(flights, f"altitude_{x}", ADJUSTABLE[0]) for x in ("error_maximum", "end_error"))
    return Outcome(
        figure,
        _flown(2),
        f"The ramp is tracked through the fault; the altitude error is at most {largest:.0f} ft, and {last:.1f} ft at "
        "the end.",
        "The paper says that the adjustable scheme responds faster in velocity. Along a ramp this cannot be seen: the "
        f"integral of the velocity error is {lag[0]:.0f} ft with tau = 0.8, {lag[1]:.0f} ft with tau = 1 and "
        f"{lag[2]:.0f} ft with the baseline. The relaxed bounds of K' make the velocity response faster on a step; the "
        "ramp does not need them. The length of the ramp is our choice; the paper gives none.",
    )


@paper_figure(15, "States in Case 2. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", *CASE_2)
def figure_15(flights: Flights) -> Outcome:
    """Draw angle of attack, pitch angle and pitch rate."""
    figure = histories(flights, ATTITUDE, _CASE_2, Zoom(95.0, 125.0), 2.1)
    off = measured(flights, "post_fault_attitude_deviation", *UNCERTAIN_2)

    def moved(start: float) -> float:
        """Return the largest change (deg) of angle of attack or pitch angle within 5 s of ``start`` (s)."""
        attitude = _during(flights[ADJUSTABLE[0]], start, start + 5.0)[:, 2:4]
        return float(np.degrees(np.abs(attitude - attitude[0]).max()))

    rates = [
        np.degrees(max(np.abs(_during(flights[name], start, start + 5.0)[:, 4]).max() for start in (20.0, 80.0)))
        for name in UNCERTAIN_2
    ]
    return Outcome(
        figure,
        _flown(2),
        f"The attitude moves by {off[0]:.2f} deg at the fault and settles.",
        f"With tau = 1 it moves less, by {off[1]:.2f} deg, and with the baseline by {off[2]:.2f} deg: this is the "
        f"price of tau = 0.8. The attitude also moves when the ramp begins, by {moved(20.0):.2f} deg, and when it "
        f"ends, by {moved(80.0):.2f} deg, because the reference starts and stops climbing within one step. At these "
        f"times, the largest pitch rate is {rates[2]:.2f} deg/s with the baseline; with the adjustable design it is "
        f"{rates[0]:.2f} deg/s at tau = 0.8 and {rates[1]:.2f} deg/s at tau = 1.",
    )


@paper_figure(
    16,
    "The generalized flexible coordinates of real system in Case 2. (a) The first-order generalized flexible "
    "coordinate. (b) Derivative of the first-order generalized flexible coordinate. (c) The second-order "
    "generalized flexible coordinate. (d) Derivative of the second-order generalized flexible coordinate.",
    *CASE_2,
)
def figure_16(flights: Flights) -> Outcome:
    """Draw both elastic coordinates with their derivatives."""
    figure = histories(flights, ELASTIC, _CASE_2, Zoom(99.0, 107.0), 1.9, apart=True)
    decay = measured(flights, "elastic_decay_time", *UNCERTAIN_2, ADJUSTABLE[1], WHOLE[1])
    return Outcome(
        figure,
        _flown(2, "the middle column shows"),
        f"The coordinates vibrate at the fault and are at rest after {decay[0]:.1f} s (both rates within 5 % of "
        "their peak).",
        f"The same is true with tau = 1 ({decay[1]:.1f} s) and with the baseline ({decay[2]:.1f} s): all three fly "
        "with the notch filter, without which the vibration continues in Case 1 (Figure 11). With nominal parameters, "
        f"the decay takes {decay[3]:.1f} s with tau = 0.8 and {decay[4]:.1f} s with tau = 1.",
    )


@paper_figure(17, "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.", *CASE_2)
def figure_17(flights: Flights) -> Outcome:
    """Draw both inputs as commanded."""
    figure = histories(flights, INPUTS, _CASE_2, Zoom(98.0, 118.0), 2.3)

    late = []  # time (s) from the fault to the largest elevator deflection
    for flight in (flights[name] for name in UNCERTAIN_2):
        assert flight.fault_start is not None
        after = flight.time >= flight.fault_start
        late.append(flight.time[after][np.argmax(flight.command[after, 1])] - flight.fault_start)
    return Outcome(
        figure,
        f"{_flown(2)} {LIMITS} outside the range of the panels.",
        f"The inputs stay within a reasonable range and are {limited(flights, CASE_2)}. With uncertain and nominal "
        f"parameters together, the fuel ratio and the elevator range over {ranges(flights, ADJUSTABLE)} with tau = "
        f"0.8, over {ranges(flights, WHOLE)} with tau = 1, and over {ranges(flights, BASELINE)} with the baseline.",
        "With tau = 0.8, the elevator responds later to the fault: its deflection is largest "
        f"{late[0]:.2f} s after the fault, compared with {late[1]:.2f} s with tau = 1 and {late[2]:.2f} s with the "
        "baseline. The jumps of the fuel ratio at 20 s and 80 s come "
        "from the climbing trim: the climb and the acceleration of the reference start and stop within one step.",
    )
