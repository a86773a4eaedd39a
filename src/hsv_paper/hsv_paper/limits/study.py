"""The physical limits next to what the controllers reach: ``hsv-paper limits``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.base.units import to_paper
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner, corners
from hsv.flight.governed import governed
from hsv.flight.metrics import SETTLING_BAND, FlightData
from hsv.flight.scenario import load_scenario, parse_scenario
from hsv.model.dynamics import VehicleParameters
from hsv.model.plant import FlightStatus
from hsv.model.vehicle import Vehicle, load_vehicle
from hsv_paper.limits.problems import (
    DELAYS,
    HORIZON,
    PERIOD,
    at_trim,
    envelope_points,
    held_periods,
    recovery,
    static_limit,
    straight,
    time_bound,
    transfer,
    turning_limit,
)
from hsv_paper.limits.replay import Flown, fly_optimum
from hsv_paper.linear_loop import START, TARGET
from hsv_paper.plots import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv_paper.study import Outcome, Scope, Study

COUPLING = "paper_like"

SCENARIOS = ("case1", "case1_smooth", "case1_qp", "case1_governed")
"""Compared with the fastest transfer."""

PERIODS, COARSE, GUESS, TOLERANCE = 200, 50, 15.0, 1e-5
"""Periods of the published transfers and of the first mesh, time (s) of the first guess, tolerance of an optimum."""

AFTER = 20.0
"""Time (s) flown in the trim after an optimum."""

MARGIN = 1e-3
"""By so much more effectiveness than the least the recoveries are flown: at the least itself no elevator is left."""

LATER = 30.0
"""A longer horizon (s) for a loss that is known at once."""

CURVE = tuple(round(0.02 * i, 2) for i in range(16))
"""Delays (s) of the figure's curves."""

BLEND, RESOLUTION = 5.0, 1e-3
"""Half the time (s) in which the rates of the governed reference change; to which effectiveness is bisected."""


@dataclass(frozen=True)
class FastestTransfer:
    """A transfer of the least ``time`` (s), that on a mesh half as fine, and its flight."""

    time: float
    coarser: float
    flown: Flown


@dataclass(frozen=True)
class DeepestFault:
    """The least effectiveness for a delay and a horizon (s), and that on a mesh twice as fine, where it was solved.

    ``turning``: by bisection; ``static``: of the trim that the optimum leads to; ``flown``: with :data:`MARGIN` more.
    """

    delay: float
    horizon: float
    effectiveness: float
    finer: float | None
    turning: float
    static: float
    flown: Flown

    def row(self, vehicle: str) -> str:
        """Return a row of the table of optima."""
        fine = "" if self.finer is None else f"{self.finer:.4f}"
        numbers = f"{self.effectiveness:.4f} | {fine} | {self.turning:.4f} | {self.static:.4f}"
        flown = "recovers" if self.flown.finished else "is lost"
        return f"| {vehicle} | {self.delay:g} | {self.horizon:g} | {numbers} | {flown} |"

    def report(self) -> dict[str, Any]:
        """Return the numbers for JSON."""
        return {
            "delay_s": self.delay,
            "horizon_s": self.horizon,
            "effectiveness": self.effectiveness,
            "finer_mesh": self.finer,
            "turning_limit": self.turning,
            "static_limit_of_its_trim": self.static,
            "flown": self.flown.finished,
            "deviation_at_end": self.flown.deviation(self.horizon),
        }


@dataclass(frozen=True)
class Limits:
    """Results: transfers in so many ``periods``, to rest and to 2 %, a bound of the former's time (s), and recoveries.

    flights: By scenario. governed: Case 1 along the reference of the governor. survived: The least effectiveness that
    Case 1's controller survives. faults: Of the nominal vehicle. worst: Of some of the corners, by their number.
    corners: (vehicles, 2 + delays), see :func:`corner_limits`; the first is the nominal vehicle. over: The changes of
    their parameters.
    """

    periods: int
    rest: FastestTransfer
    settled: FastestTransfer
    bound: float
    flights: dict[str, FlightData]
    governed: FlightData
    survived: float
    faults: list[DeepestFault]
    worst: dict[int, list[DeepestFault]]
    over: Sequence[Corner]
    corners: np.ndarray


def fastest_transfer(vehicle: VehicleParameters, periods: int, *, settling: bool) -> FastestTransfer:
    """Return the fastest transfer with so many ``periods``; see :func:`hsv_paper.limits.problems.transfer`."""
    first = transfer(vehicle, COARSE, settling=settling)
    half = transfer(vehicle, periods // 2, settling=settling)
    whole = transfer(vehicle, periods, settling=settling)
    coarse = first.solve(straight(first, GUESS), 10.0 * TOLERANCE)
    coarser = half.solve(coarse.finer(periods // 2 // COARSE), TOLERANCE)
    found = whole.solve(coarser.finer(2), TOLERANCE)
    flown = fly_optimum(whole, found, np.ones(len(found.input), dtype=int), AFTER)
    return FastestTransfer(found.scalar, coarser.scalar, flown)


def deepest_fault(
    vehicle: VehicleParameters, envelope: Vehicle, delay: float, horizon: float, *, refine: bool
) -> DeepestFault:
    """Return the deepest loss of effectiveness; see :func:`hsv_paper.limits.problems.recovery`."""
    problem = recovery(vehicle, envelope, delay, horizon)
    found = problem.solve(at_trim(problem), TOLERANCE)
    fine = recovery(vehicle, envelope, delay, horizon, 2)
    share = found.scalar
    flown = fly_optimum(problem, found, np.array(held_periods(horizon)), AFTER, share + MARGIN, round(delay / PERIOD))
    return DeepestFault(
        delay,
        horizon,
        share,
        fine.solve(found.finer(2), TOLERANCE).scalar if refine else None,
        turning_limit(vehicle, delay),
        static_limit(vehicle, found.state[-1:, :2]),
        flown,
    )


def corner_limits(
    vehicle: VehicleParameters, envelope: Vehicle, over: Sequence[Corner], delays: tuple[float, ...]
) -> np.ndarray:
    """Return limits (vehicles, 2 + delays): static at the target, static in the envelope, turning after each delay."""
    points = envelope_points(envelope)
    rows = []
    for corner in over:
        other = vehicle.perturbed(corner)
        static = [static_limit(other, np.array([TARGET])), static_limit(other, points)]
        rows.append([*static, *(turning_limit(other, delay) for delay in delays)])
    return np.array(rows)


def needed_effectiveness(limits: np.ndarray) -> np.ndarray:
    """Return the effectiveness (vehicles, delays) that is needed both to turn the vehicle and to hold it.

    ``limits``: as :func:`corner_limits` returns them.
    """
    return np.maximum(limits[:, 2:], limits[:, 1:2])


def least_survived(scenario: str) -> float:
    """Return the least effectiveness that the nominal vehicle survives in a scenario, by bisection.

    ``scenario``: One whose first fault is a loss of effectiveness.
    """
    lost, survived = 0.3, 1.0
    while survived - lost > RESOLUTION:
        middle = 0.5 * (lost + survived)
        flight = fly(assemble_flight(load_scenario(scenario, {"fault[0].effectiveness": middle})))
        lost, survived = (lost, middle) if flight.status is FlightStatus.FINISHED else (middle, survived)
    return survived


def run(scope: Scope) -> Outcome:
    """Solve both problems; a coarse study has half as many periods, few corners, and optima of none of them."""
    whole = scope.coarseness <= 1.0
    envelope = load_vehicle()
    vehicle = envelope.coupled(COUPLING)
    periods = PERIODS if whole else PERIODS // 2
    total = 5 + len(DELAYS) * (3 if whole else 1)
    done = 0

    def stage(what: str) -> None:
        nonlocal done
        scope.progress(what, done, total)
        done += 1

    stage("fastest transfer to rest")
    rest = fastest_transfer(vehicle, periods, settling=False)
    stage("fastest transfer to 2 %")
    settled = fastest_transfer(vehicle, periods, settling=True)
    stage("bound of the time")
    bound = time_bound(vehicle)
    stage("flights of the controllers")
    flights = {name: fly(assemble_flight(load_scenario(name))).data() for name in SCENARIOS}
    along = parse_scenario(governed("case1", BLEND).text, "case1")
    flown = fly(assemble_flight(along)).data()
    survived = least_survived("case1")
    stage("corners")
    every = corners(envelope.uncertainty)
    over = every if whole else every[:: min(512, round(64 * scope.coarseness))]
    limits = corner_limits(vehicle, envelope, over, CURVE)
    faults = []
    for delay in DELAYS:
        stage(f"deepest fault known after {delay:g} s")
        faults.append(deepest_fault(vehicle, envelope, delay, HORIZON, refine=whole))
    worst: dict[int, list[DeepestFault]] = {}
    if whole:
        faults.append(deepest_fault(vehicle, envelope, 0.0, LATER, refine=False))
        for index in worst_corners(limits):
            worst[index] = []
            for delay in DELAYS:
                stage(f"deepest fault known after {delay:g} s, corner {index}")
                at = vehicle.perturbed(over[index])
                worst[index].append(deepest_fault(at, envelope, delay, HORIZON, refine=False))
    scope.progress("done", total, total)
    found = Limits(periods, rest, settled, bound, flights, flown, survived, faults, worst, over, limits)
    return Outcome(_figure(found), _shows(found), _findings(found), _numbers(found))


def worst_corners(limits: np.ndarray) -> tuple[int, ...]:
    """Return the corners with the worst static limit and with the worst limit for the longest delay."""
    slowest = 2 + CURVE.index(DELAYS[-1])
    return tuple(dict.fromkeys((int(np.argmax(limits[:, 1])), int(np.argmax(limits[:, slowest])))))


def settling_times(flight: FlightData) -> np.ndarray:
    """Return the times (2), s, from which altitude and velocity stay within 2 % of the whole change up to the fault.

    The change is from the first state to the last reference, whether that is a step or not; infinite: not settled.
    """
    before = flight.time < (np.inf if flight.fault_start is None else flight.fault_start - 1e-9)
    target = flight.reference[-1, :2]
    off = np.abs(flight.state[before, :2] - target) > SETTLING_BAND * np.abs(target - flight.state[0, :2])
    last = [int(np.flatnonzero(column)[-1]) + 1 if column.any() else 0 for column in off.T]
    return np.array([flight.time[index] if index < len(off) else np.inf for index in last])


def _settled(data: FlightData) -> float:
    return float(settling_times(data).max())


def _rounded_down(value: float) -> float:
    return math.floor(100.0 * value) / 100.0


def _shows(found: Limits) -> str:
    rest, settled, limits = found.rest, found.settled, found.corners
    needed = needed_effectiveness(limits)
    settling = [
        f"| {name} | {times[0]:.1f} | {times[1]:.1f} | {times.max() / settled.time:.1f} |"
        for name, times in ((name, settling_times(data)) for name, data in found.flights.items())
    ]
    rows = [fault.row("nominal") for fault in found.faults]
    rows += [fault.row(f"corner {index}") for index, solved in found.worst.items() for fault in solved]
    over_all = [
        "| trim at Case 1's target | " + _range(limits[:, 0]),
        "| a trim in the envelope | " + _range(limits[:, 1]),
        *(
            f"| nose turned and a trim in the envelope, known after {delay:g} s | "
            + _range(needed[:, CURVE.index(delay)])
            for delay in DELAYS
        ),
    ]
    named = [
        f"Corner {index}: "
        + ", ".join(f"{name.replace('_', ' ')} {100.0 * change:+g} %" for name, change in found.over[index].items())
        + "."
        for index in found.worst
    ]
    return _TEXT.format(
        rest=rest.time,
        rest_mesh=100.0 * abs(rest.coarser / rest.time - 1.0),
        settled=settled.time,
        settled_mesh=100.0 * abs(settled.coarser / settled.time - 1.0),
        bound=_rounded_down(found.bound),
        periods=found.periods,
        deviation=max(rest.flown.deviation(), settled.flown.deviation()),
        gap=100.0 * (rest.time / found.bound - 1.0),
        settling="\n".join(settling),
        blend=BLEND,
        governed=_settled(found.governed),
        survived=found.survived,
        margin=MARGIN,
        after=AFTER,
        faults="\n".join(rows),
        count=len(limits) - 1,
        over="\n".join(over_all),
        named="\n\n".join(named),
    )


def _range(limits: np.ndarray) -> str:
    """Return cells for the nominal vehicle, the first, and for the best and the worst of the others."""
    return f"{limits[0]:.3f} | {limits[1:].min():.3f} | {limits[1:].max():.3f} |"


def _findings(found: Limits) -> tuple[str, ...]:
    rest, settled, limits = found.rest, found.settled, found.corners
    ratios = ", ".join(f"{_settled(data) / settled.time:.1f} ({name})" for name, data in found.flights.items())
    known = " and from ".join(
        f"{fault.effectiveness:.3f} if it is known after {fault.delay:g} s"
        for fault in found.faults
        if fault.delay > 0.0
    )
    at_once = [fault for fault in found.faults if fault.delay == 0.0]
    moving = " and ".join(f"{fault.effectiveness:.3f} within {fault.horizon:g} s" for fault in at_once)
    findings = [
        f"the fastest transfer takes {rest.time:.2f} s to rest, and none takes less than "
        f"{_rounded_down(found.bound):.2f} s; altitude "
        f"and velocity can be within 2 % from {settled.time:.2f} s on. The controllers take this many times as long: "
        f"{ratios}",
        f"known at once, a loss costs nothing as long as a trim is left: the vehicle holds its trim down to "
        f"{limits[0, 0]:.3f}, and comes to another one that needs less elevator down to {moving}; below "
        f"{limits[0, 1]:.3f} no point of the envelope is one",
        f"the nominal vehicle is recoverable from {known}: every further tenth of a second costs about "
        f"{found.faults[2].effectiveness - found.faults[1].effectiveness:.3f}",
    ]
    if found.worst:
        column = 2 + CURVE.index(DELAYS[-1])
        findings.append(
            f"over all corners the limit for {DELAYS[-1]:g} s is at most {limits[:, column].max():.3f}, and the trim "
            f"at the target needs at most {limits[:, 0].max():.3f}: every corner is recoverable from 0.5 "
            "if it is known by then"
        )
    return tuple(findings)


def _numbers(found: Limits) -> dict[str, Any]:
    rest, settled, limits = found.rest, found.settled, found.corners
    return {
        "transfer_s": {"rest": rest.time, "rest_half_mesh": rest.coarser, "bound": found.bound},
        "settling_s": {"least": settled.time, "least_half_mesh": settled.coarser}
        | {name: _settled(data) for name, data in found.flights.items()}
        | {"governed": _settled(found.governed)},
        "replay_deviation": {"rest": rest.flown.deviation(), "settled": settled.flown.deviation()},
        "faults": [fault.report() for fault in found.faults],
        "worst_corners": {
            str(index): {"perturbation": dict(found.over[index]), "faults": [fault.report() for fault in solved]}
            for index, solved in found.worst.items()
        },
        "least_survived": {"case1": found.survived},
        "corners": {
            "static_at_target": limits[:, 0].tolist(),
            "static_in_envelope": limits[:, 1].tolist(),
            "turning": {f"{delay:g}": limits[:, 2 + i].tolist() for i, delay in enumerate(CURVE)},
        },
    }


def _figure(found: Limits) -> Any:
    figure = new_figure(7.6)
    axes = figure.subplots(3, 2)
    feet, degrees = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]
    shown = {"case1": ORANGE, "case1_governed": GREEN}
    limits = found.corners
    optima = ((found.rest, "to rest", BLUE), (found.settled, "to 2 %", RED))
    for axis, state, name in ((axes[0, 0], 0, "altitude change (ft)"), (axes[0, 1], 1, "velocity change (ft/s)")):
        for fastest, label, color in optima:
            axis.plot(
                fastest.flown.time, feet * (fastest.flown.state[:, state] - START[state]), color=color, label=label
            )
        for scenario, color in shown.items():
            data = found.flights[scenario]
            axis.plot(data.time, feet * (data.state[:, state] - START[state]), color=color, label=scenario)
        axis.set(xlim=(0.0, 40.0), xlabel="time (s)", ylabel=name)
        step = feet * (TARGET[state] - START[state])
        axis.axhspan(0.98 * step, 1.02 * step, color=GREY, alpha=0.3, linewidth=0)
    axes[0, 0].legend(loc="lower right")
    for axis, column, factor, name in (
        (axes[1, 0], 0, 1.0, "fuel equivalence ratio"),
        (axes[1, 1], 1, degrees, "elevator (deg)"),
    ):
        for fastest, _, color in optima:
            _held(axis, fastest.flown, factor, column, color)
        axis.set(xlim=(0.0, 16.0), xlabel="time (s)", ylabel=name)
    axis = axes[2, 0]
    for fault, color in zip(found.faults, (GREY, BLUE, RED), strict=False):
        _held(axis, fault.flown, degrees, 1, color, f"known after {fault.delay:g} s")
    axis.set(xlim=(0.0, HORIZON), xlabel="time after the loss (s)", ylabel="elevator command (deg)")
    axis.legend(loc="center left")
    axis = axes[2, 1]
    needed = needed_effectiveness(limits)
    axis.fill_between(CURVE, needed[1:].min(axis=0), needed[1:].max(axis=0), color=BLUE, alpha=0.2, linewidth=0)
    axis.plot(CURVE, needed[0], color=BLUE, label="nominal; shaded: corners")
    axis.axhline(limits[0, 0], color=GREY, linestyle=":", label="trim at the target")
    at_horizon = [fault for fault in found.faults if fault.horizon == HORIZON]
    axis.plot([f.delay for f in at_horizon], [f.effectiveness for f in at_horizon], "o", color=RED, label="optima")
    axis.set(xlabel="delay (s)", ylabel="least effectiveness")
    axis.legend(loc="upper left")
    letter(axes.flat)
    return figure


def _held(axis: Axes, flown: Flown, factor: float, column: int, color: str, label: str = "") -> None:
    axis.step(flown.time[:-1], factor * flown.command[:, column], where="post", color=color, label=label or None)


_TEXT = """(a), (b) The fastest transfers and two flights; shaded: 2 % of the step. (c), (d) Inputs of the fastest
transfers. (e) Elevator commands of the recoveries from the deepest losses. (f) The least effectiveness by the time
after which it is known, by bisection (lines) and by optimal control.

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

The optimum is a local one, to which the iteration comes from different guesses. Independently of it, no transfer takes
less than {bound:.2f} s: of every transfer between two trims the changes of velocity, altitude and path angle are known,
and the mean pitching moment is zero; for the best weights of the four, the largest weighted rate that U permits gives
this bound, for transfers within 100 m, 10 m/s and 5 deg of path angle of the trims. The optimum is thus within
{gap:.1f} % of the fastest.
For the time to 2 %, where the vehicle is not at rest, there is no such bound. Flown by the loop's plant, both are
within {deviation:.0e} of what was computed, in units of 100 m, 50 m/s and 0.03 rad.

| scenario | settled: h s | V s | later, times the least |
| --- | ---: | ---: | ---: |
{settling}

The fastest reference of the [governor](../governor.md) for this step, `hsv govern case1 --blend "{blend:g} s"`,
settles in {governed:.1f} s.

## The deepest loss of effectiveness
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
elevator at its stop and no fuel keep both below those of any other input.

For the nominal vehicle and the worst of all corners:

| vehicle | known after, s | horizon s | least P | on a mesh twice as fine | turning | static, at its end | flown |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |
{faults}

Flown: with {margin:g} more than the least, through the loop's plant and fault injector, and {after:g} s in the trim
after it. At the least itself no elevator is left in a trim at the static limit, and rounding decides.

All vehicles, the nominal one and {count} corners of the parameter bounds:

| least P for | nominal | best corner | worst corner |
| --- | ---: | ---: | ---: |
{over}

{named}

Of the passive controllers, that of `case1` loses the nominal vehicle below {survived:.3f}, by bisection with the fault
at 100 s; [resilience](../resilience.md) has the others, and faults in the manoeuvre."""

STUDY = Study("limits", "Fastest transfer and deepest fault", run, 15, kind="Physical limits", command="limits")
