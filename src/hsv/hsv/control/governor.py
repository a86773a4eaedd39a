"""Command governor: the fastest jerk-limited reference whose nominal plan stays inside U minus F Z at every step.

A command, whatever its form, is a list of legs: a point of altitude and velocity, when it is asked for, and the least
time that the way there is to take. A leg is flown as a ramp with blended corners along the climbing, accelerating trims
of :mod:`hsv.control.reference_trajectory`. Its length is found by bisection, in whole periods: the shortest for which
x_n (paper eq. 20), driven by the defect of the reference, leaves u_r + u_n inside U minus F Z (eq. 30) in every step,
and no input changes faster than its actuator can.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from hsv.control.nominal_law import NominalData, nominal_input
from hsv.control.nominal_trajectory import nominal_advance
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.errors import GovernorError, TrimError
from hsv.vehicle.dynamics import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_STATES
from hsv.vehicle.parameters import VehicleParameters

LONGEST = 600.0
"""Length of a leg (s) that is given up: a slower one leaves no more room to speak of."""

AFTERWARDS = 10.0
"""Time (s) for which a plan is watched after its last corner; x_n has died out then."""

KEPT_FREE = 1e-3
"""Share of U minus F Z that is kept free on every side: in flight the plan is scheduled by what is measured."""


class Leg(NamedTuple):
    """The way to a point: altitude (m), velocity (m/s); ``start`` (s) when it is asked for, least ``duration`` (s)."""

    start: float
    duration: float
    altitude: float
    velocity: float


@dataclass(frozen=True)
class InputBounds:
    """Bounds of the total nominal input: smallest and largest u_r + u_n (2 each), and largest rates (2) per second."""

    minimum: np.ndarray
    maximum: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True)
class GovernedReference:
    """Corners of the reference, ``times`` (s), ``altitudes`` (m), ``velocities`` (m/s), and their ``blend`` (s).

    ``plan`` (k, 2): u_r + u_n of every step; ``deviation`` (k, 9): x_n.
    """

    times: tuple[float, ...]
    altitudes: tuple[float, ...]
    velocities: tuple[float, ...]
    blend: float
    plan: np.ndarray
    deviation: np.ndarray

    @property
    def end(self) -> float:
        """Time at which the reference has come to rest, s."""
        return self.times[-1] + self.blend


def legs_of(
    start: tuple[float, float], times: Sequence[float], altitudes: Sequence[float], velocities: Sequence[float]
) -> list[Leg]:
    """Return the legs of piecewise-linear commands from the point ``start``: altitude (m), velocity (m/s).

    Of two equal times the later is a step, as is a first command that is not where the flight starts.
    """
    legs, now, there = [], 0.0, start
    for time, *point in zip(times, altitudes, velocities, strict=True):
        if tuple(point) != there:
            legs.append(Leg(now, time - now, *point))
        now, there = time, (point[0], point[1])
    return legs


class Governor:
    """Finds references for the nominal system ``nominal`` of a design and the decoupled vehicle ``rigid``."""

    def __init__(self, nominal: NominalData, rigid: VehicleParameters, period: float, bounds: InputBounds) -> None:
        """Plan with ``period`` (s) within ``bounds``."""
        self._nominal, self._rigid, self._period = nominal, rigid, period
        self._bounds = bounds
        free = KEPT_FREE * (bounds.maximum - bounds.minimum)
        self._low, self._high = bounds.minimum + free, bounds.maximum - free

    def govern(self, start: tuple[float, float], legs: Sequence[Leg], blend: float) -> GovernedReference:
        """Return the fastest reference from level flight at ``start``, altitude (m) and velocity (m/s), over ``legs``.

        Args:
            start: Start of the flight, in trim.
            legs: Legs in order; each begins when requested, or when the previous one has reached its corner.
            blend: Half the time in which the rate changes at a corner, s; as whole periods.

        Raises:
            GovernorError: A leg for which nothing fits; it says why.
        """
        half = math.ceil(blend / self._period - 1e-9)
        if not (legs and half > 0):
            raise GovernorError("command: none, expected one" if half > 0 else f"blend = {blend:g} s: expected above 0")
        corners = [(half, *start)]
        for number, leg in enumerate(legs, start=1):
            first = max(math.ceil(leg.start / self._period - 1e-9) + half, corners[-1][0])
            if first > corners[-1][0]:
                corners.append((first, *corners[-1][1:]))
            corners.append(self._corner(corners, leg, half, f"command {number}"))
        plan, deviation, _ = self._planned(corners, half)
        steps, altitudes, velocities = zip(*corners, strict=True)
        times = tuple(self._seconds(step) for step in steps)
        return GovernedReference(times, altitudes, velocities, self._seconds(half), plan, deviation)

    def _corner(
        self, corners: list[tuple[int, float, float]], leg: Leg, half: int, name: str
    ) -> tuple[int, float, float]:
        """Return the earliest corner at the end of ``leg`` whose plan fits."""
        begin = corners[-1][0]

        def problem(length: int) -> str:
            return self._problem([*corners, (begin + length, leg.altitude, leg.velocity)], half)

        least, most = max(1, math.ceil(leg.duration / self._period - 1e-9)), math.ceil(LONGEST / self._period)
        if not problem(least):
            return begin + least, leg.altitude, leg.velocity
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
        return begin + fits, leg.altitude, leg.velocity

    def _problem(self, corners: list[tuple[int, float, float]], half: int) -> str:
        """Return why the plan of a reference does not fit, nothing where it does."""
        try:
            plan, _, held = self._planned(corners, half)
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
            if fastest > self._bounds.rate[i]:
                return (
                    f"the plan moves {name} by {fastest:.6g} {unit or '1'}/s, expected at most "
                    f"{self._bounds.rate[i]:.6g}, the limit of its actuator"
                )
        return ""

    def _planned(self, corners: list[tuple[int, float, float]], half: int) -> tuple[np.ndarray, np.ndarray, bool]:
        """Return u_r + u_n (k, 2), x_n (k, 9), and whether x_n stayed in the family.

        Raises:
            TrimError: A point of the reference without an equilibrium.
        """
        steps, altitudes, velocities = zip(*corners, strict=True)
        times = [self._seconds(step) for step in steps]
        blend = self._seconds(half)
        reference = ReferenceTrajectory(times, altitudes, velocities, self._period, self._rigid, blend=blend)
        rows = steps[-1] + half + math.ceil(AFTERWARDS / self._period)
        plan, deviation = np.empty((rows, N_INPUTS)), np.empty((rows, N_STATES))
        held = _plan(self._nominal, reference.data, plan, deviation)
        return plan, deviation, bool(held)

    def _seconds(self, step: int) -> float:
        return round(step * self._period, 9)


@njit(cache=True)
def _plan(nominal: Any, reference: Any, plan: np.ndarray, deviation: np.ndarray) -> bool:
    """Write u_r + u_n (k, 2) and x_n (k, 9), 0 at first, scheduled by x_r + x_n; tell whether the family held it."""
    n, m = deviation.shape[1], plan.shape[1]
    x_n, u_n, defect = np.zeros(n), np.empty(m), np.empty(n)
    weights, S, new = np.empty(len(nominal.polytope.S)), np.empty(n * (n + m)), np.empty(n)
    last = len(reference.state) - 1
    held = True
    for k in range(len(plan)):
        row = min(max(k - reference.first, 0), last)
        for i in range(n):
            deviation[k, i] = x_n[i]
            defect[i] = reference.defect[row, i]
        _, inside = nominal_input(nominal, x_n, u_n)
        held = held and inside
        for i in range(m):
            plan[k, i] = reference.input[row, i] + u_n[i]
        altitude, velocity = reference.state[row, 0] + x_n[0], reference.state[row, 1] + x_n[1]
        nominal_advance(nominal.polytope, altitude, velocity, x_n, u_n, defect, weights, S, new)
    return held
