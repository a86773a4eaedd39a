"""Command governor: the fastest jerk-limited reference whose nominal plan stays inside U minus F Z at every step.

A command is a list of legs. A leg has a target point of altitude and velocity, the time of the request, and a minimum
duration. It becomes a ramp with blended corners along the climbing, accelerating trims of
:mod:`hsv.control.reference_trajectory`. Bisection finds the shortest ramp, in integer numbers of periods, that keeps
u_r + u_n inside U minus F Z (paper eq. 30) in every step, with x_n (eq. 20) driven by the defect of the reference. The
ramp must also keep x_n in the ellipsoids of the nominal gains and move no input faster than its actuator can.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hsv.base.errors import GovernorError, TrimError
from hsv.control.design import ControlDesign, PlanBounds
from hsv.control.nominal_trajectory import LAWS, NominalTrajectory
from hsv.control.reference_trajectory import TRIMS, Corner, ReferenceTrajectory
from hsv.core import Struct, doubles, lib, vector
from hsv.model.actuators import actuator_data
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_STATES
from hsv.model.vehicle import Vehicle

LONGEST = 600.0
"""Maximum duration of a leg, s; a slower one hardly needs less of the inputs."""

SETTLE_TIME = 10.0
"""Time (s) for which a plan is checked after its last blend; x_n has decayed by then."""

USUAL_BLEND = 2.0
"""Default half-width of the blend at a corner, s: half the time in which the rate changes."""

LEAD_TIME = 2.0
"""Simulated time (s) between a command in flight and the first step that it changes. Planning takes 0.1 to 2 s of
processor time, so that a flight in real time need not wait for it."""

MARGIN_SHARE = 1e-3
"""Share of U minus F Z that a plan leaves free on every side. The model is scheduled by x_r + x_n in planning, by the
measured state in flight."""


class Leg(NamedTuple):
    """A leg of a command: request time ``start`` (s), minimum ``duration`` (s), target altitude (m), velocity (m/s)."""

    start: float
    duration: float
    altitude: float
    velocity: float


@dataclass(frozen=True)
class GovernedReference:
    """A planned reference: its ``corners``, and from the first planned step on the nominal input and state.

    ``plan`` (k, 2) is u_r + u_n in each step, ``deviation`` (k, 9) is x_n.
    """

    corners: tuple[Corner, ...]
    plan: np.ndarray
    deviation: np.ndarray

    @property
    def blend(self) -> float:
        """Half-width of the blend at the last corner, s."""
        return self.corners[-1].blend

    @property
    def end(self) -> float:
        """Time from which the reference is constant, s."""
        return self.corners[-1].time + self.blend


class Beginning(NamedTuple):
    """The start of a plan: the number of its first step, and the nominal state x_n (9) in that step."""

    step: int
    deviation: np.ndarray


AT_REST = Beginning(0, np.zeros(N_STATES))
"""The start of a plan for a flight that begins in trim."""


def legs_of(
    start: tuple[float, float], times: Sequence[float], altitudes: Sequence[float], velocities: Sequence[float]
) -> list[Leg]:
    """Return the legs of piecewise-linear commands from the point ``start``: altitude (m), velocity (m/s).

    A jump, given by two equal times, becomes a leg without minimum duration, and so does a first command at time 0 that
    differs from ``start``. Constant parts do not become legs.
    """
    legs, now, there = [], 0.0, start
    for time, *point in zip(times, altitudes, velocities, strict=True):
        if tuple(point) != there:
            legs.append(Leg(now, time - now, *point))
        now, there = time, (point[0], point[1])
    return legs


class Governor:
    """Command governor for the nominal system ``nominal`` of a design and the decoupled vehicle ``rigid``."""

    def __init__(
        self, nominal: Struct, rigid: VehicleParameters, period: float, bounds: PlanBounds, rate: np.ndarray
    ) -> None:
        """Plan with the control ``period`` (s), the ``bounds`` of a design and rate limits ``rate`` (2, per s)."""
        self._nominal, self._rigid, self._period, self._rate = nominal, rigid, period, rate
        free = MARGIN_SHARE * (bounds.input_maximum - bounds.input_minimum)
        self._low, self._high = bounds.input_minimum + free, bounds.input_maximum - free

    def govern(self, start: tuple[float, float], legs: Sequence[Leg], blend: float) -> GovernedReference:
        """Return the fastest reference from level flight at ``start`` over all ``legs``.

        Args:
            start: Altitude (m) and velocity (m/s) at the start of the flight, in trim.
            legs: Legs in order. The first corner of each is ``blend`` after its request, so that the blend begins then,
                or is the last corner of the previous leg if that is later.
            blend: Half-width of the blend at each corner, s, rounded up to a multiple of the period.

        Raises:
            GovernorError: There is no leg, no reference fits a leg, or ``blend`` is out of its range.
        """
        half = self._half(blend)
        if not legs:
            raise GovernorError("command: none, expected one")
        corners = [Corner(self._seconds(half), *start, self._seconds(half))]
        for number, leg in enumerate(legs, start=1):
            first = max(self._steps(leg.start) + half, self._steps(corners[-1].time))
            if first > self._steps(corners[-1].time):
                corners.append(corners[-1]._replace(time=self._seconds(first)))
            corners.append(self._corner(corners, leg, half, f"command {number}", AT_REST))
        return self._reference(corners, AT_REST)

    def continued(
        self, corners: Sequence[Corner], leg: Leg, blend: float, beginning: Beginning
    ) -> tuple[GovernedReference, int]:
        """Return the fastest reference that continues ``corners`` by one ``leg``, and the first step that changes.

        All earlier steps equal those of ``corners``, bit for bit. The blend into the leg begins when requested, but
        its corner comes after the last of ``corners``, and no step before ``beginning`` changes.

        Raises:
            GovernorError: No reference fits, or ``blend`` is out of its range.
        """
        half = self._half(blend)
        last = corners[-1]
        first = max(self.first_change(corners, leg.start, blend), beginning.step)
        turn = Corner(self._seconds(first + half), last.altitude, last.velocity, self._seconds(half))
        known = [*corners, turn]
        return self._reference([*known, self._corner(known, leg, half, "command", beginning)], beginning), first

    def first_change(self, corners: Sequence[Corner], start: float, blend: float) -> int:
        """Return the first step that a leg requested for time ``start`` (s) changes in a reference with ``corners``.

        Raises:
            GovernorError: The half-width ``blend`` (s) is out of its range.
        """
        return max(self._steps(start), self._steps(corners[-1].time) + 1 - self._half(blend))

    def trajectory(self, corners: Sequence[Corner]) -> ReferenceTrajectory:
        """Return the reference trajectory with these ``corners``.

        Raises:
            TrimError: There is no equilibrium at a point of the trajectory.
        """
        times, altitudes, velocities, blends = zip(*corners, strict=True)
        return ReferenceTrajectory(times, altitudes, velocities, self._period, self._rigid, blend=blends)

    def _reference(self, corners: Sequence[Corner], beginning: Beginning) -> GovernedReference:
        plan, deviation, _ = self._planned(corners, beginning)
        return GovernedReference(tuple(corners), plan, deviation)

    def _half(self, blend: float) -> int:
        """Return a ``blend`` (s) in steps, rounded up; a GovernorError refuses a value out of its range."""
        if not 0.0 < blend <= LONGEST or not (half := self._steps(blend)):
            raise GovernorError(f"blend = {blend:g} s: expected above 0 s, up to {LONGEST:g} s")
        return half

    def _corner(self, corners: Sequence[Corner], leg: Leg, half: int, name: str, beginning: Beginning) -> Corner:
        """Find by bisection the earliest corner at which ``leg`` can end; ``half`` is the blend's half-width, steps."""
        begin = self._steps(corners[-1].time)

        def end(length: int) -> Corner:
            return Corner(self._seconds(begin + length), leg.altitude, leg.velocity, self._seconds(half))

        def problem(length: int) -> str:
            return self._problem([*corners, end(length)], beginning)

        least, most = max(1, self._steps(leg.duration)), self._steps(LONGEST)
        if not problem(least):
            return end(least)
        longer = 2 * least
        while longer < most and problem(longer):
            least, longer = longer, 2 * longer
        if longer >= most and (why := problem(most)):
            raise GovernorError(
                f"{name}: no reference to {leg.altitude:.6g} m and {leg.velocity:.6g} m/s fits, not one of "
                f"{LONGEST:g} s either: {why}"
            )
        fits = min(longer, most)
        while fits - least > 1:
            middle = (least + fits) // 2
            if problem(middle):
                least = middle
            else:
                fits = middle
        return end(fits)

    def _problem(self, corners: Sequence[Corner], beginning: Beginning) -> str:
        """Return the reason why the plan of a reference does not fit; empty if it does."""
        try:
            plan, _, held = self._planned(corners, beginning)
        except TrimError as error:
            return str(error)
        if not held:
            return "x_n leaves the family of nominal gains"
        rate = np.abs(np.diff(plan, axis=0)) / self._period
        for i, (name, unit) in enumerate(zip(INPUT_NAMES, ("", *INPUT_UNITS[1:]), strict=True)):
            least, most, fastest = plan[:, i].min(), plan[:, i].max(), rate[:, i].max()
            if not (least >= self._low[i] and most <= self._high[i]):
                return (
                    f"the plan needs {name} from {least:.6g} to {most:.6g} {unit}".rstrip()
                    + f", expected {self._low[i]:.6g} to {self._high[i]:.6g}, U minus F Z"
                )
            if fastest > self._rate[i]:
                return (
                    f"the plan moves {name} by {fastest:.6g} {unit or '1'}/s, expected at most {self._rate[i]:.6g}, "
                    "the limit of its actuator"
                )
        return ""

    def _planned(self, corners: Sequence[Corner], beginning: Beginning) -> tuple[np.ndarray, np.ndarray, bool]:
        """Return u_r + u_n (k, 2), x_n (k, 9), and whether x_n stays in the ellipsoids of the nominal gains."""
        rows = self._steps(corners[-1].time + corners[-1].blend + SETTLE_TIME) - beginning.step
        plan, deviation = np.empty((rows, N_INPUTS)), np.empty((rows, N_STATES))
        reference = self.trajectory(corners).data
        held = lib.hsv_plan(
            self._nominal.pointer,
            reference.pointer,
            beginning.step,
            rows,
            *map(doubles, (vector(beginning.deviation), plan, deviation)),
        )
        return plan, deviation, bool(held)

    def _steps(self, time: float) -> int:
        """Return the first step at or after ``time`` (s)."""
        return math.ceil(time / self._period - 1e-9)

    def _seconds(self, step: int) -> float:
        return round(step * self._period, 9)


def command_in_flight(
    values: Mapping[str, object],
    design: ControlDesign | None,
    trajectory: NominalTrajectory,
    target: tuple[float, float],
    duration: float = 0.0,
    blend: float = 0.0,
) -> tuple[int, Callable[[], ReferenceTrajectory]]:
    """Check a command in flight: a leg to another point, as fast as the tightened bounds permit, after earlier legs.

    Args:
        values: Flat parameters from which ``design`` and ``trajectory`` were built.
        design: Design with a certified plan.
        trajectory: Nominal trajectory in flight.
        target: Altitude (m) and velocity (m/s) of the point.
        duration: Minimum length of the ramp, s.
        blend: Half-width of the blend at a corner, s; 0: :data:`USUAL_BLEND`.

    Returns:
        The first step that the command changes, at least :data:`LEAD_TIME` ahead, and a function that plans the leg.
        The function takes 0.1 to 2 s and may run in another thread while the flight goes on up to that step. It returns
        the new reference, or raises a GovernorError if none fits.

    Raises:
        GovernorError: The design, nominal law or trim does not permit it, a number is out of its range, the target is
            that of the previous command, or no step has been computed.
    """
    if design is None or design.plan_bounds is None:
        name = design.name if design else "none"
        raise GovernorError(f"design = {name!r}: expected one that has tightened inputs")
    for name, governed in (("nominal.law", LAWS[0]), ("reference.trim", TRIMS[0])):
        if (given := values.get(name, governed)) != governed:
            raise GovernorError(f"{name} = {given!r}: expected {governed!r}")
    vehicle, (altitude, velocity) = Vehicle.from_parameters(values), target
    ranges = {
        "altitude": (altitude, "m", vehicle.altitude_range),
        "velocity": (velocity, "m/s", vehicle.velocity_range),
        "duration": (duration, "s", (0.0, LONGEST)),
        "blend": (blend, "s", (0.0, LONGEST)),
    }
    for name, (value, unit, (least, largest)) in ranges.items():
        if not least <= value <= largest:
            raise GovernorError(f"{name} = {value:.6g} {unit}: expected {least:.6g} to {largest:.6g} {unit}")
    if trajectory.next_step == 0:
        raise GovernorError("no step is flown yet: expected a command in flight")
    corners = trajectory.reference.corners
    if corners[-1][1:3] == target:
        raise GovernorError(
            f"altitude = {altitude:.6g} m, velocity = {velocity:.6g} m/s: expected another point than the command "
            "before"
        )
    blend = blend or USUAL_BLEND
    beginning = Beginning(trajectory.next_step, trajectory.deviation)
    leg = Leg(beginning.step * design.period + LEAD_TIME, duration, altitude, velocity)
    rate = actuator_data(values, vehicle.decoupled, design.period).rate_limit
    governor = Governor(trajectory.data, vehicle.decoupled, design.period, design.plan_bounds, rate)

    def plan() -> ReferenceTrajectory:
        return governor.trajectory(governor.continued(corners, leg, blend, beginning)[0].corners)

    return governor.first_change(corners, leg.start, blend), plan
