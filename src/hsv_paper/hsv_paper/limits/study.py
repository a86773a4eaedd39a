"""The study of ``hsv-paper limits``: the physical limits, compared with what the controllers reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner, corners
from hsv.flight.flight import Flight
from hsv.flight.governed import governed
from hsv.flight.metrics import SETTLING_BAND
from hsv.flight.scenario import load_scenario, parse_scenario
from hsv.model.dynamics import VehicleParameters
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle, load_vehicle
from hsv_paper.limits import problems
from hsv_paper.limits.optimum import Point, Problem
from hsv_paper.linear_loop import START, TARGET
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv_paper.study import Outcome, Scope, Study, rounded

SCENARIOS = ("case1", "case1_smooth", "case1_qp", "case1_governed")
"""Scenarios that are compared with the fastest transfer."""

PERIODS, COARSE, GUESS, TOLERANCE = 200, 50, 15.0, 1e-5
"""Periods of the published transfers and of the first mesh, time (s) of the first guess, tolerance of an optimum."""

CURVE = tuple(round(0.02 * i, 2) for i in range(16))
"""Delays (s) at which the figure's curves are computed."""

BLEND = 5.0
"""Half the time (s) over which the rates of the governed reference change."""


@dataclass(frozen=True)
class Optimum:
    """The optimum of a problem, and the same optimum on another mesh, half or twice as fine."""

    problem: Problem
    found: Point
    other: Point

    @property
    def change(self) -> float:
        """Magnitude (%) of the change of the optimal scalar from one mesh to the other."""
        return 100.0 * abs(self.other.scalar / self.found.scalar - 1.0)


def fastest_transfer(vehicle: VehicleParameters, periods: int, *, settling: bool) -> Optimum:
    """Return the optimum of :func:`hsv_paper.limits.problems.transfer`; ``periods`` is a multiple of 100."""
    first, half, whole = (problems.transfer(vehicle, n, settling=settling) for n in (COARSE, periods // 2, periods))
    coarse = first.solve(problems.straight(first, GUESS), 10.0 * TOLERANCE)
    coarser = half.solve(coarse.finer(periods // 2 // COARSE), TOLERANCE)
    return Optimum(whole, whole.solve(coarser.finer(2), TOLERANCE), coarser)


def deepest_fault(vehicle: VehicleParameters, envelope: Vehicle, delay: float) -> Optimum:
    """Return the deepest loss of effectiveness; :func:`hsv_paper.limits.problems.recovery` states the problem."""
    problem, fine = (problems.recovery(vehicle, envelope, delay, problems.HORIZON, divide) for divide in (1, 2))
    found = problem.solve(problems.at_trim(problem), TOLERANCE)
    return Optimum(problem, found, fine.solve(found.finer(2), TOLERANCE))


def fault_row(fault: Optimum, delay: float) -> dict[str, Any]:
    """Return the table row of a deepest fault: the optimum next to the limits that are known without optimisation."""
    vehicle, found = fault.problem.vehicle, fault.found
    numbers = {
        "least P": found.scalar,
        "on a mesh twice as fine": fault.other.scalar,
        "turning": problems.turning_limit(vehicle, delay),
        "static, at its end": problems.static_limit(vehicle, found.state[-1:, :2]),
    }
    return {"known after, s": f"{delay:g}"} | {head: rounded(number, 4) for head, number in numbers.items()}


def corner_limits(
    vehicle: VehicleParameters, envelope: Vehicle, over: Sequence[Corner], delays: tuple[float, ...]
) -> np.ndarray:
    """Return least effectiveness (vehicles, 2 + delays): trim at target; trim in the envelope; nose turned by delay."""
    points = problems.envelope_points(envelope)
    rows = []
    for corner in over:
        other = vehicle.perturbed(corner)
        static = [problems.static_limit(other, np.array([TARGET])), problems.static_limit(other, points)]
        rows.append([*static, *(problems.turning_limit(other, delay) for delay in delays)])
    return np.array(rows)


def run(scope: Scope) -> Outcome:
    """Find the fastest transfers and the deepest faults; a coarse study has half as many periods and fewer corners."""
    whole = scope.coarseness <= 1.0
    envelope = load_vehicle()
    vehicle = envelope.coupled("paper_like")
    periods = PERIODS if whole else PERIODS // 2
    scope.progress("fastest transfers", 0, 4)
    rest, settled = (fastest_transfer(vehicle, periods, settling=settling) for settling in (False, True))
    scope.progress("flights of the controllers", 1, 4)
    flights = {name: fly(assemble_flight(load_scenario(name))) for name in SCENARIOS}
    along = parse_scenario(governed("case1", BLEND).text, "case1")
    named = f'[governor](../governor.md), `hsv govern case1 --blend "{BLEND:g} s"`'
    flights[named] = fly(assemble_flight(along))
    scope.progress("corners", 2, 4)
    over = corners(envelope.uncertainty)[:: 1 if whole else min(512, round(64 * scope.coarseness))]
    limits = corner_limits(vehicle, envelope, over, CURVE)
    needed = np.maximum(limits[:, 2:], limits[:, 1:2])  # to turn the nose, and to hold a trim
    scope.progress("deepest faults", 3, 4)
    faults = [deepest_fault(vehicle, envelope, delay) for delay in problems.DELAYS]
    scope.progress("done", 4, 4)

    def settling(name: str, data: Flight) -> dict[str, Any]:
        times = settling_times(data)
        cells = (*times, times.max() / settled.found.scalar)
        heads = ("settled: h s", "V s", "later, times the least")
        return {"scenario": name} | {head: rounded(cell, 1) for head, cell in zip(heads, cells, strict=True)}

    def over_all(name: str, values: np.ndarray) -> dict[str, Any]:
        cells = {"nominal": values[0], "best corner": values[1:].min(), "worst corner": values[1:].max()}
        return {"least P for": name} | {head: rounded(cell, 3) for head, cell in cells.items()}

    turned = "nose turned and a trim in the envelope"
    return Outcome(
        _figure(rest, settled, flights, faults, needed),
        _TRANSFER.format(
            rest=rest.found.scalar,
            rest_mesh=rest.change,
            settled=settled.found.scalar,
            settled_mesh=settled.change,
            periods=periods,
        ),
        [settling(name, data) for name, data in flights.items()],
        _FAULT,
        [fault_row(fault, delay) for fault, delay in zip(faults, problems.DELAYS, strict=True)],
        f"All vehicles, the nominal one and {len(limits) - 1} corners of the parameter bounds:",
        [
            over_all("trim at Case 1's target", limits[:, 0]),
            over_all("a trim in the envelope", limits[:, 1]),
            *(over_all(f"{turned}, known after {t:g} s", needed[:, CURVE.index(t)]) for t in problems.DELAYS),
        ],
        "The controllers lose the vehicle earlier; [resilience](../resilience.md) has them.",
    )


def settling_times(flight: Flight) -> np.ndarray:
    """Return the settling times (s) of altitude and velocity before the fault, shape (2,); infinite if unsettled.

    Settled: within 2 % of the distance from first state to last reference until the fault or, without one, the end.
    """
    before = flight.time < (np.inf if flight.fault_start is None else flight.fault_start - 1e-9)
    target = flight.reference[-1, :2]
    tracked = flight.history.state[:, :2]
    off = np.abs(tracked[before] - target) > SETTLING_BAND * np.abs(target - tracked[0])
    last = [int(np.flatnonzero(column)[-1]) + 1 if column.any() else 0 for column in off.T]
    return np.array([flight.time[index] if index < len(off) else np.inf for index in last])


def _figure(
    rest: Optimum, settled: Optimum, flights: dict[str, Flight], faults: Sequence[Optimum], needed: np.ndarray
) -> Figure:
    figure = new_figure(7.6)
    axes = figure.subplots(3, 2)
    optima = ((rest, "to rest", BLUE), (settled, "to 2 %", RED))

    def drawn(axis: Axes, optimum: Optimum, values: np.ndarray, end: float, **style: Any) -> None:
        """Draw the values at an optimum's times, extended to ``end`` (s): the vehicle stays in its last trim."""
        axis.plot([*optimum.problem.times(optimum.found.scalar), end], [*values, values[-1]], **style)
        axis.set_xlim(0.0, end)

    for axis, state, name in ((axes[0, 0], 0, "altitude change (ft)"), (axes[0, 1], 1, "velocity change (ft/s)")):
        for optimum, label, color in optima:
            drawn(axis, optimum, FEET * (optimum.found.state[:, state] - START[state]), 40.0, color=color, label=label)
        for label, color in (("case1", ORANGE), ("case1_governed", GREEN)):
            flight = flights[label]
            axis.plot(flight.time, FEET * (flight.history.state[:, state] - START[state]), color=color, label=label)
        axis.set(xlabel="time (s)", ylabel=name)
        step = FEET * (TARGET[state] - START[state])
        axis.axhspan(0.98 * step, 1.02 * step, color=GREY, alpha=0.3, linewidth=0)
    axes[0, 0].legend(loc="lower right")
    held: Any = {"drawstyle": "steps-post"}
    for column, (factor, name) in enumerate(((1.0, "fuel equivalence ratio"), (DEGREES, "elevator (deg)"))):
        for optimum, _, color in optima:
            after = trim(optimum.problem.vehicle, *TARGET).input
            values = factor * np.array([*optimum.found.input, after])[:, column]
            drawn(axes[1, column], optimum, values, 16.0, color=color, **held)
        axes[1, column].set(xlabel="time (s)", ylabel=name)
    axis = axes[2, 0]
    for fault, delay, color in zip(faults, problems.DELAYS, (GREY, BLUE, RED), strict=True):
        command = DEGREES * fault.found.input[[*range(len(fault.found.input)), -1], 1] / fault.found.scalar
        label = f"known after {delay:g} s"
        drawn(axis, fault, command, problems.HORIZON, color=color, label=label, **held)
    axis.set(xlabel="time after the loss (s)", ylabel="elevator command (deg)")
    axis.legend(loc="center left")
    axis = axes[2, 1]
    axis.fill_between(CURVE, needed[1:].min(axis=0), needed[1:].max(axis=0), color=BLUE, alpha=0.2, linewidth=0)
    axis.plot(CURVE, needed[0], color=BLUE, label="nominal; shaded: corners")
    target = problems.static_limit(rest.problem.vehicle, np.array([TARGET]))
    axis.axhline(target, color=GREY, linestyle=":", label="trim at the target")
    axis.plot(problems.DELAYS, [fault.found.scalar for fault in faults], "o", color=RED, label="optima")
    axis.set(xlabel="delay (s)", ylabel="least effectiveness")
    axis.legend(loc="upper left")
    letter(axes.flat)
    return figure


_TRANSFER = """(a), (b) The fastest transfers and two flights; shaded: 2 % of the step. (c), (d) Inputs of the
fastest transfers. (e) Elevator commands of the recoveries from the deepest losses. (f) The least effectiveness by the
time after which it is known, by bisection (lines) and by optimal control.

## The fastest transfer
Case 1's step, from rest in its trim at 85500 ft and 7900 ft/s to 86100 ft and 8150 ft/s, of the vehicle as flown:
coupled, with both elastic modes, nominal parameters, inputs anywhere within U and held over {periods} equal periods.
Case 1 has ideal actuators, and so there are no rate limits. Angles stay within the range of the model. Two least times:
- **To rest**: all nine states are those of the target's trim, the elastic modes at rest: {rest:.2f} s. On a mesh half
  as fine it is {rest_mesh:.2g} % more.
- **To 2 %**: altitude and velocity are within 2 % of their steps and stay there, as settling times are measured, on a
  way to rest that takes 0.4 of that time more: {settled:.2f} s ({settled_mesh:.2g} % more on the coarser mesh).

The fuel is at its upper limit nearly all the way, and the elevator keeps the angle of attack where thrust less drag is
largest, first above and then below the trim's, so that the altitude changes by what is asked: velocity takes the time.
Between 2 % and rest many inputs are as good, and those in the figure are one choice.

The optimum is a local one, to which the iteration comes from different guesses."""

_FAULT = """## The deepest loss of effectiveness
The vehicle is in the trim of Case 1's target when the elevator's effectiveness falls to P, for good. Until it is known,
the command of the trim is kept; from then on any inputs within U that are best for this P. It is to be in a trim of the
faulty vehicle, anywhere in the envelope of commands, and never outside the range of the model. Limits of P:
- **Static**: the elevator of the trim, divided by its travel. It is less at higher velocities and lower altitudes.
- **Turning**: with the elevator at its stop and without fuel, whose thrust lifts the nose, the pitch-up of the time
  before is just stopped. Found by bisection of flights, without any optimisation.
- **Optimum**: the least P for which inputs exist, by optimal control, with P among the unknowns.

The optimum equals the larger of the turning limit and the static limit of the trim that it leads to, to the resolution
of the bisection: nothing else limits the recovery. The reason, for the rigid pitch motion: angle of attack and pitch
rate each grow with the other, the elevator lowers the growth of both and thrust raises that of the pitch rate, so that
elevator at its stop and no fuel keep both below those of any other input. Known at once, a loss costs nothing as long
as a trim is left.

For the nominal vehicle, within 10 s:"""

STUDY = Study("limits", "Fastest transfer and deepest fault", run, 12, kind="Physical limits")
