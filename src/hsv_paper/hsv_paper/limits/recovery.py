"""The deepest constant loss of elevator effectiveness from which inputs within U still recover the vehicle.

The vehicle is in its trim at Case 1's target when the effectiveness falls from 1 to P; the elevator that acts is P
times the command. For a delay the command of the trim is kept, then any inputs within U are permitted.
"""

from __future__ import annotations

import numpy as np

from hsv.base.errors import TrimError
from hsv.model.dynamics import VehicleParameters, advance, in_model_range
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle
from hsv_paper.limits.optimum import Bounds, Point, Problem, guess
from hsv_paper.limits.transfer import free_states
from hsv_paper.linear_loop import TARGET

PERIOD = 0.02
"""T (s), as flown."""

SUBSTEPS = 2
"""Runge-Kutta steps per period, as flown."""

DELAYS = (0.0, 0.1, 0.2)
"""Times (s) after which the effectiveness is known."""

HORIZON = 10.0
"""Time (s) in which the vehicle is to be in a trim."""

COST = 10.0
"""Weight of P against defects: a tenth of P is a unit."""


def recovery(vehicle: VehicleParameters, envelope: Vehicle, delay: float, horizon: float, divide: int = 1) -> Problem:
    """Return the problem of the least effectiveness, s, from which the vehicle comes to a trim in its envelope.

    Inputs are those that act on the vehicle. They are held for one period at first, for 2 from 1.5 s on, for 5 from
    3 s on.

    Args:
        vehicle: Parameters, perturbed or not.
        envelope: The vehicle's envelope of commands, which has the trim at the end.
        delay: s.
        horizon: Time from the fault to the trim (s).
        divide: In how many each period is divided, for a finer mesh.
    """
    before = trim(vehicle, *TARGET)
    held = np.array(held_periods(horizon))
    period = np.repeat(held * PERIOD / divide, divide)
    n, kept = len(period), round(delay / PERIOD) * divide
    low, high = free_states(vehicle, before.state, n)
    for i, (axis_low, axis_high) in enumerate((envelope.altitude_range, envelope.velocity_range)):
        low[-1, i], high[-1, i] = axis_low, axis_high
    bounds = Bounds(*(np.zeros((n, 2)) for _ in range(4)))
    bounds.low[:, 0], bounds.high[:, 0] = vehicle.fuel_equivalence_ratio_minimum, vehicle.fuel_equivalence_ratio_maximum
    bounds.low_slope[:, 1], bounds.high_slope[:, 1] = (
        vehicle.elevator_deflection_minimum,
        vehicle.elevator_deflection_maximum,
    )
    bounds.low[:kept, 0] = bounds.high[:kept, 0] = before.input[0]
    bounds.low_slope[:kept, 1] = bounds.high_slope[:kept, 1] = before.input[1]
    substeps = np.repeat(SUBSTEPS * held, divide)
    return Problem(vehicle, period, np.zeros(n), substeps, bounds, low, high, True, (0.05, 1.0), COST)


def held_periods(horizon: float) -> list[int]:
    """Return for how many periods of the flight each input is held, up to a ``horizon`` (s)."""
    held: list[int] = []
    while (time := sum(held) * PERIOD) < horizon - 1e-9:
        held.append(1 if time < 1.5 - 1e-9 else 2 if time < 3.0 - 1e-9 else 5)
    return held


def at_trim(problem: Problem) -> Point:
    """Return the first guess: the vehicle stays in its trim, at half of the effectiveness."""
    before = trim(problem.vehicle, *TARGET)
    n = len(problem.period)
    return guess(0.5, np.tile(before.state, (n + 1, 1)), np.tile(before.input, (n, 1)))


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
    axes = [(low, 0.5 * (low + high), high) for low, high in (envelope.altitude_range, envelope.velocity_range)]
    return np.array([(altitude, velocity) for altitude in axes[0] for velocity in axes[1]])


def turning_limit(vehicle: VehicleParameters, delay: float, resolution: float = 1e-4) -> float:
    """Return the least effectiveness with which the elevator at its stop turns the vehicle's nose down.

    Found by bisection of flights, without any optimisation: after the ``delay`` (s) the elevator goes to its stop and
    the fuel, whose thrust lifts the nose, is shut off; the nose is turned when the angle of attack is back at
    that of the trim.
    """
    before = trim(vehicle, *TARGET)
    low, high = 0.0, 1.0
    while high - low > resolution:
        share = 0.5 * (low + high)
        if _turns(vehicle, before.state, before.input, round(delay / PERIOD), share):
            high = share
        else:
            low = share
    return high


def _turns(vehicle: VehicleParameters, state: np.ndarray, inputs: np.ndarray, kept: int, share: float) -> bool:
    x = state
    stop = np.array([vehicle.fuel_equivalence_ratio_minimum, vehicle.elevator_deflection_maximum])
    for k in range(int(20.0 / PERIOD)):
        x = advance(x, (inputs if k < kept else stop) * [1.0, share], vehicle, PERIOD, SUBSTEPS)
        if k >= kept and x[4] < 0.0 and x[2] <= state[2]:
            return True
        if not in_model_range(x, vehicle.angle_limit):
            return False
    return False
