"""Two optimal control problems: the fastest transfer of Case 1, and the deepest loss of elevator effectiveness.

The transfer leads the simulated vehicle from trim at the start to trim at the target, with any inputs in U. Its time
ends in one of two ways: when all states are at rest in the target's trim; or, as settling times are measured, when
altitude and velocity are within 2 % of their total changes, and stay there until the vehicle is at rest.

In the second problem, the vehicle is in its trim at the target when the effectiveness falls from 1 to P: only P times
the elevator command acts. The trim's command is kept during a delay; afterwards any inputs in U are permitted.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from hsv.base.errors import TrimError
from hsv.flight.metrics import SETTLING_BAND
from hsv.model.dynamics import VehicleParameters, advance, in_model_range
from hsv.model.signals import N_STATES
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle
from hsv_paper.limits.optimum import Point, Problem
from hsv_paper.linear_loop import START, TARGET

PERIOD, SUBSTEPS = 0.02, 2
"""The period T (s) and its Runge-Kutta steps in flight."""

LONGEST, TYPICAL = 60.0, 12.0
"""Upper bound of a transfer's time (s), and the time for which its Runge-Kutta steps are as long as in flight."""

REST = 0.4
"""Time from settling to rest, as a share of the time to settling. A longer one does not change the result."""

DELAYS = (0.0, 0.1, 0.2)
"""Delays (s) until the effectiveness is known."""

HORIZON = 10.0
"""Time (s) within which the vehicle must reach a trim."""

COST = 10.0
"""Weight of P against the defects: a change of P by a tenth counts as one unit."""


def transfer(vehicle: VehicleParameters, periods: int, *, settling: bool, rest: float = REST) -> Problem:
    """Return the problem of the least time s, in seconds, of the transfer from Case 1's start to its target.

    Args:
        periods: Number of periods of equal length, with held inputs, within s.
        settling: Whether s is the time until altitude and velocity stay within 2 % of their total changes; the vehicle
            is at rest after ``rest`` times s more. Otherwise s is the time until rest.
    """
    start, target = trim(vehicle, *START), trim(vehicle, *TARGET)
    total = periods + (round(rest * periods) if settling else 0)
    low, high = free_states(vehicle, start.state, total)
    if settling:
        band = SETTLING_BAND * np.abs(target.state[:2] - start.state[:2])
        low[periods:, :2], high[periods:, :2] = target.state[:2] - band, target.state[:2] + band
    low[-1] = high[-1] = target.state
    inputs = np.tile([[vehicle.input_minimum], [vehicle.input_maximum]], (1, total, 1))
    substeps = np.full(total, max(2, round(TYPICAL / periods * SUBSTEPS / PERIOD)))
    none, slope = np.zeros(total), np.full(total, 1.0 / periods)
    states, scalar = np.stack((low, high)), (1.0, LONGEST)
    return Problem(vehicle, none, slope, substeps, inputs, np.zeros_like(inputs), states, False, scalar)


def free_states(vehicle: VehicleParameters, start: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper bounds (N + 1, 9) of the states: first ``start`` (9), then angles in the model's range."""
    low = np.full((periods + 1, N_STATES), -np.inf)
    high = -low
    low[:, 2:4], high[:, 2:4] = -vehicle.angle_limit, vehicle.angle_limit
    low[0] = high[0] = start
    return low, high


def straight(problem: Problem, time: float) -> Point:
    """Return a first guess that takes ``time`` (s): straight lines of states and inputs from trim to trim."""
    start, target = trim(problem.vehicle, *START), trim(problem.vehicle, *TARGET)
    share = np.minimum(problem.times(time) / time, 1.0)[:, None]
    state = start.state + share * (target.state - start.state)
    inputs = (start.input + share * (target.input - start.input))[:-1]
    return Point(time, state, inputs, np.zeros((len(inputs), N_STATES)))


def recovery(vehicle: VehicleParameters, envelope: Vehicle, delay: float, horizon: float, divide: int = 1) -> Problem:
    """Return the problem of the least effectiveness s with which the vehicle reaches a trim in the envelope.

    The inputs of the problem are those that act on the vehicle. Each is held for one control period at first, for two
    from 1.5 s on, and for five from 3 s on.

    Args:
        envelope: The vehicle whose envelope of commands must contain the final trim.
        delay: Time (s) for which the trim's command is kept.
        horizon: Time from the fault to the final trim (s).
        divide: Number of parts into which each of these intervals is divided, for a finer mesh.
    """
    before = trim(vehicle, *TARGET)
    held: list[int] = []
    while (time := sum(held) * PERIOD) < horizon - 1e-9:
        held.append(1 if time < 1.5 - 1e-9 else 2 if time < 3.0 - 1e-9 else 5)
    period = np.repeat(np.array(held) * PERIOD / divide, divide)
    n, kept = len(period), round(delay / PERIOD) * divide
    low, high = free_states(vehicle, before.state, n)
    low[-1, :2], high[-1, :2] = np.transpose((envelope.altitude_range, envelope.velocity_range))
    # The fuel is within its limits, the acting elevator deflection within s times those of the command.
    inputs, slope = np.zeros((2, n, 2)), np.zeros((2, n, 2))
    for side, limits in enumerate((vehicle.input_minimum, vehicle.input_maximum)):
        inputs[side, :, 0], slope[side, :, 1] = limits
    inputs[:, :kept, 0], slope[:, :kept, 1] = before.input
    substeps, states = np.repeat(SUBSTEPS * np.array(held), divide), np.stack((low, high))
    return Problem(vehicle, period, np.zeros(n), substeps, inputs, slope, states, True, (0.05, 1.0), COST)


def at_trim(problem: Problem) -> Point:
    """Return the first guess of the recovery: the vehicle stays in its trim, with half of the effectiveness."""
    before = trim(problem.vehicle, *TARGET)
    n = len(problem.period)
    return Point(0.5, np.tile(before.state, (n + 1, 1)), np.tile(before.input, (n, 1)), np.zeros((n, N_STATES)))


def static_limit(vehicle: VehicleParameters, points: np.ndarray) -> float:
    """Return the least effectiveness for a trim at one of ``points`` (M, 2), altitude m, velocity m/s; inf if none."""
    least = np.inf
    for altitude, velocity in points:
        try:
            needed = trim(vehicle, altitude, velocity).input[1]
        except TrimError:
            continue
        stop = vehicle.elevator_deflection_maximum if needed > 0.0 else vehicle.elevator_deflection_minimum
        least = min(least, needed / stop)
    return float(least)


def envelope_points(envelope: Vehicle) -> np.ndarray:
    """Return nine pairs (9, 2) of altitude (m) and velocity (m/s): a grid of three by three over the envelope."""
    return np.array([*product(*(np.linspace(*axis, 3) for axis in (envelope.altitude_range, envelope.velocity_range)))])


def turning_limit(vehicle: VehicleParameters, delay: float, resolution: float = 1e-4) -> float:
    """Return the least effectiveness with which the elevator at its stop turns the vehicle's nose down.

    It is found by bisection of flights, without optimisation. After the ``delay`` (s) the elevator goes to its stop,
    and the fuel, whose thrust lifts the nose, is shut off. The nose has turned when it falls and the angle of attack is
    back at that of the trim, within 20 s and within the model's range. The result is 1 if no effectiveness suffices.
    """
    before, kept = trim(vehicle, *TARGET), round(delay / PERIOD)
    stop = np.array([vehicle.fuel_equivalence_ratio_minimum, vehicle.elevator_deflection_maximum])

    def turns(share: float) -> bool:
        x = before.state
        for k in range(int(20.0 / PERIOD)):
            x = advance(x, (before.input if k < kept else stop) * [1.0, share], vehicle, PERIOD, SUBSTEPS)
            if k >= kept and x[4] < 0.0 and x[2] <= before.state[2]:
                return True
            if not in_model_range(x, vehicle.angle_limit):
                return False
        return False

    low, high = 0.0, 1.0
    while high - low > resolution:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if turns(middle) else (middle, high)
    return high
