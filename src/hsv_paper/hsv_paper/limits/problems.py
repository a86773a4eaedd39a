"""The two problems: the fastest transfer of Case 1's step, and the deepest loss of elevator effectiveness.

The transfer is between the two trims of the step, of the vehicle as flown, inputs anywhere in U. Two meanings of
fastest: all of the vehicle is at rest in the target's trim, or, as settling times are measured, altitude and velocity
are within 2 % of their steps of the target and stay there on a way on which it comes to rest.

The vehicle is in its trim at the target when the effectiveness falls from 1 to P; the elevator that acts is P times the
command. For a delay the command of the trim is kept, then any inputs within U are permitted.
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
"""T (s), and its Runge-Kutta steps, as flown."""

LONGEST, TYPICAL = 60.0, 12.0
"""Upper bound of the time of a transfer (s), and the longest one with the Runge-Kutta steps of flights."""

REST = 0.4
"""Time from settling to rest, as a share of the time to settling: a longer one changes nothing."""

DELAYS = (0.0, 0.1, 0.2)
"""Times (s) after which the effectiveness is known."""

HORIZON = 10.0
"""Time (s) in which the vehicle is to be in a trim."""

COST = 10.0
"""Weight of P against defects: a tenth of P is a unit."""


def transfer(vehicle: VehicleParameters, periods: int, *, settling: bool, rest: float = REST) -> Problem:
    """Return the problem of the least time (s), s, from Case 1's start to its target.

    Args:
        periods: Number of periods of equal length within that time in which inputs are held.
        settling: The time is that after which altitude and velocity are within 2 % of their steps of the target; the
            vehicle is at rest there a share ``rest`` of the time later. Otherwise it is the time to rest.
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
    """Return bounds (N + 1, 9) each of states from a ``start`` (9) that leave the vehicle in the model's range."""
    low = np.full((periods + 1, N_STATES), -np.inf)
    high = -low
    low[:, 2:4], high[:, 2:4] = -vehicle.angle_limit, vehicle.angle_limit
    low[0] = high[0] = start
    return low, high


def straight(problem: Problem, time: float) -> Point:
    """Return a first guess of ``time`` (s): states and inputs in a straight line from trim to trim."""
    start, target = trim(problem.vehicle, *START), trim(problem.vehicle, *TARGET)
    share = np.minimum(problem.times(time) / time, 1.0)[:, None]
    state = start.state + share * (target.state - start.state)
    inputs = (start.input + share * (target.input - start.input))[:-1]
    return Point(time, state, inputs, np.zeros((len(inputs), N_STATES)))


def recovery(vehicle: VehicleParameters, envelope: Vehicle, delay: float, horizon: float, divide: int = 1) -> Problem:
    """Return the problem of the least effectiveness, s, from which the vehicle comes to a trim in its envelope.

    Inputs are those that act on the vehicle. They are held for one period at first, for 2 from 1.5 s on, for 5 from
    3 s on.

    Args:
        envelope: The vehicle's envelope of commands, which has the trim at the end.
        delay: s.
        horizon: Time from the fault to the trim (s).
        divide: In how many each period is divided, for a finer mesh.
    """
    before = trim(vehicle, *TARGET)
    held: list[int] = []
    while (time := sum(held) * PERIOD) < horizon - 1e-9:
        held.append(1 if time < 1.5 - 1e-9 else 2 if time < 3.0 - 1e-9 else 5)
    period = np.repeat(np.array(held) * PERIOD / divide, divide)
    n, kept = len(period), round(delay / PERIOD) * divide
    low, high = free_states(vehicle, before.state, n)
    low[-1, :2], high[-1, :2] = np.transpose((envelope.altitude_range, envelope.velocity_range))
    # The fuel is between its limits, the elevator that acts between s times those of the command.
    inputs, slope = np.zeros((2, n, 2)), np.zeros((2, n, 2))
    for side, limits in enumerate((vehicle.input_minimum, vehicle.input_maximum)):
        inputs[side, :, 0], slope[side, :, 1] = limits
    inputs[:, :kept, 0], slope[:, :kept, 1] = before.input
    substeps, states = np.repeat(SUBSTEPS * np.array(held), divide), np.stack((low, high))
    return Problem(vehicle, period, np.zeros(n), substeps, inputs, slope, states, True, (0.05, 1.0), COST)


def at_trim(problem: Problem) -> Point:
    """Return the first guess: the vehicle stays in its trim, at half of the effectiveness."""
    before = trim(problem.vehicle, *TARGET)
    n = len(problem.period)
    return Point(0.5, np.tile(before.state, (n + 1, 1)), np.tile(before.input, (n, 1)), np.zeros((n, N_STATES)))


def static_limit(vehicle: VehicleParameters, points: np.ndarray) -> float:
    """Return the least effectiveness with which one of ``points`` (M, 2), altitude m and velocity m/s, is a trim."""
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
    """Return a grid (9, 2) of altitudes (m) and velocities (m/s) over the envelope: its corners, sides and middle."""
    return np.array([*product(*(np.linspace(*axis, 3) for axis in (envelope.altitude_range, envelope.velocity_range)))])


def turning_limit(vehicle: VehicleParameters, delay: float, resolution: float = 1e-4) -> float:
    """Return the least effectiveness with which the elevator at its stop turns the vehicle's nose down.

    Found by bisection of flights, without any optimisation: after the ``delay`` (s) the elevator goes to its stop and
    the fuel, whose thrust lifts the nose, is shut off; the nose is turned when the angle of attack is back at
    that of the trim.
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
