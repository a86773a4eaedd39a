"""The fastest transfer between the two trims of Case 1's step, of the vehicle as flown, inputs anywhere in U.

Two meanings of fastest: all of the vehicle is at rest in the target's trim, or, as settling times are measured,
altitude and velocity are within 2 % of their steps of the target and stay there on a way on which it comes to rest.
"""

from __future__ import annotations

from array import array
from itertools import product

import numpy as np
from scipy.optimize import minimize

from hsv.core import ffi, lib
from hsv.flight.metrics import SETTLING_BAND
from hsv.model.dynamics import VehicleParameters, vehicle_struct
from hsv.model.signals import N_STATES
from hsv.model.trim import trim
from hsv_paper.limits.optimum import Bounds, Point, Problem, guess
from hsv_paper.linear_loop import START, TARGET

SUBSTEP = 0.01
"""Runge-Kutta step (s) of the flights."""

MARGIN = np.array([100.0, 10.0])
"""Altitude (m) and velocity (m/s)."""

GRID_ERROR = 5e-4
"""More than the largest rate between the points of the grid can exceed that at them, of itself: from its curvature."""

LONGEST = 60.0
"""Upper bound of the time (s)."""

REST = 0.4
"""Time from settling to rest, as a share of the time to settling: a longer one changes nothing."""

TYPICAL = 12.0
"""Time (s) for which Runge-Kutta steps are as long as in flights; where the time is longer, so are they."""


def transfer(vehicle: VehicleParameters, periods: int, *, settling: bool, rest: float = REST) -> Problem:
    """Return the problem of the least time (s), s, from Case 1's start to its target.

    Args:
        vehicle: Parameters.
        periods: Number of periods of equal length within that time in which inputs are held.
        settling: The time is that after which altitude and velocity are within 2 % of their steps of the target; the
            vehicle is at rest there a share ``rest`` of the time later. Otherwise it is the time to rest.
        rest: Share.
    """
    start, target = trim(vehicle, *START), trim(vehicle, *TARGET)
    total = periods + (round(rest * periods) if settling else 0)
    low, high = free_states(vehicle, start.state, total)
    if settling:
        band = SETTLING_BAND * np.abs(target.state[:2] - start.state[:2])
        low[periods:, :2], high[periods:, :2] = target.state[:2] - band, target.state[:2] + band
    low[-1] = high[-1] = target.state
    one, none = np.ones((total, 1)), np.zeros((total, 2))
    bounds = Bounds(one * vehicle.input_minimum, one * vehicle.input_maximum, none, none)
    substeps = np.full(total, max(2, round(TYPICAL / periods / SUBSTEP)))
    slope = np.full(total, 1.0 / periods)
    return Problem(vehicle, np.zeros(total), slope, substeps, bounds, low, high, False, (1.0, LONGEST))


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
    share = np.concatenate(([0.0], np.cumsum(problem.periods(time))))
    share = np.minimum(share / time, 1.0)[:, None]
    state = start.state + share * (target.state - start.state)
    return guess(time, state, (start.input + share * (target.input - start.input))[:-1])


def time_bound(vehicle: VehicleParameters) -> float:
    """Return a time (s) below which no input within U brings the vehicle from rest at the start to rest at the target.

    Over such a transfer, the velocity changes by the difference of both trims and the altitude likewise; the path
    angle does not change, nor do pitch rate and elastic rates, so that the pitching moment, too, is zero on average.
    For any weights, the integral of R = dV/dt + a dh/dt + b dgamma/dt + c M / I is thus known, and the time is at least
    that integral over the largest R. The weights are those of the best such bound. The largest R is that over U, over
    angles of attack within the model's range, path angles up to 5 deg, and altitudes and velocities up to
    :data:`MARGIN` outside those of the trims: the bound is for transfers that stay in there.
    """
    start, target = trim(vehicle, *START).state, trim(vehicle, *TARGET).state
    change = target[:2] - start[:2]
    altitudes = np.array([start[0] - MARGIN[0], 0.5 * (start[0] + target[0]), target[0] + MARGIN[0]])
    velocities = np.array([start[1] - MARGIN[1], 0.5 * (start[1] + target[1]), target[1] + MARGIN[1]])
    fuel = np.array([vehicle.fuel_equivalence_ratio_minimum, vehicle.fuel_equivalence_ratio_maximum])
    elevator = np.linspace(vehicle.elevator_deflection_minimum, vehicle.elevator_deflection_maximum, 121)
    alpha = np.linspace(-vehicle.angle_limit, vehicle.angle_limit, 241)
    path = np.radians([-5.0, 0.0, 5.0])
    scale = np.array([vehicle.gravity / start[1], start[1], 1.0])
    climb, acceleration, turn, moment = _rates(vehicle, altitudes, velocities, alpha, path, fuel, elevator)

    def inverse(weights: np.ndarray) -> float:
        a, b, c = weights * scale
        largest = (acceleration + a * climb - b * turn + c * moment / vehicle.moment_of_inertia).max()
        return -float((change[1] + a * change[0]) / largest)

    simplex = np.array([[1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [1.0, 0.2, 0.0], [1.0, 0.2, -10.0]])
    found = minimize(inverse, simplex[0], method="Nelder-Mead", options={"initial_simplex": simplex, "fatol": 1e-3})
    return -float(found.fun) * (1.0 - GRID_ERROR)


def _rates(
    vehicle: VehicleParameters,
    altitudes: np.ndarray,
    velocities: np.ndarray,
    alphas: np.ndarray,
    paths: np.ndarray,
    fuels: np.ndarray,
    elevators: np.ndarray,
) -> np.ndarray:
    """Return rates of altitude, velocity and angle of attack and the pitching moment on a grid, (4, points).

    The R of :func:`time_bound` is affine in the fuel, the thrust being so.
    """
    struct = vehicle_struct(vehicle).pointer
    x, u, rates, force = (ffi.new(f"double[{size}]") for size in (N_STATES, 2, N_STATES, 6))
    found = array("d")
    axes = (axis.tolist() for axis in (altitudes, velocities, alphas, paths, fuels, elevators))
    for altitude, velocity, alpha, path, fuel, elevator in product(*axes):
        x[0:4] = altitude, velocity, alpha, alpha + path
        u[0:2] = fuel, elevator
        lib.hsv_derivative(x, u, struct, ffi.NULL, rates)
        lib.hsv_forces(x, u, struct, ffi.NULL, force)
        found.extend((rates[0], rates[1], rates[2], force[3]))
    return np.array(found).reshape(-1, 4).T.copy()
