"""Equilibrium of flight at a given altitude and velocity (paper eq. 5): level, or climbing and accelerating."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.compiled import njit
from hsv.elementary import arcsine
from hsv.elimination import solve
from hsv.errors import TrimError
from hsv.vehicle.dynamics import INPUT_NAMES, N_INPUTS, N_STATES, derivative, jacobian
from hsv.vehicle.parameters import VehicleParameters

CONVERGED = 1e-9
"""Largest remaining imbalance of an equilibrium, SI per second; what Newton's method reaches is rounding, far below."""

INITIAL_GUESS = np.array([0.03, 0.3, 0.2])
"""Angle of attack (rad), fuel equivalence ratio and elevator deflection (rad): good all over the envelope."""


@dataclass(frozen=True)
class Trim:
    """An equilibrium: ``state`` (9) and ``input`` (2), SI, and the largest remaining imbalance in SI units per second.

    The imbalance is |dx/dt|, less the commanded climb rate and acceleration.
    """

    state: np.ndarray
    input: np.ndarray
    residual: float


@njit(cache=True)
def balance(
    rigid: Any,
    path_angle: float,
    acceleration: float,
    unknown: np.ndarray,
    x: np.ndarray,
    u: np.ndarray,
    pitch_rate: float = 0.0,
) -> float:
    """Complete the equilibrium of ``x`` (9) and ``u`` (2) in place; return the largest remaining imbalance.

    Newton's method with exact derivatives in angle of attack, fuel equivalence ratio and elevator deflection, from
    ``unknown`` (3), which is replaced by the best that was found; the velocity equation, less ``acceleration``
    (m/s^2), and those of angle of attack and pitch rate go to zero. The pitch angle follows from ``path_angle`` (rad).
    The elastic coordinates are N_i / omega_i^2: the pitching moment is zero, whatever the inertial coupling.

    Args:
        rigid: Parameters of the decoupled vehicle.
        path_angle: Flight-path angle, pitch angle less angle of attack.
        acceleration: dV/dt.
        unknown: First guess.
        x: Altitude and velocity given; the others are written.
        u: Written.
        pitch_rate: That of a steady pull-up, the rate of the flight-path angle; the angle of attack does not change.
    """
    rates = np.empty(N_STATES)
    slope, right = np.empty((3, 3)), np.empty((3, 1))
    trial = unknown.copy()
    best_size = np.inf
    x[4:] = 0.0
    x[4] = pitch_rate
    for _ in range(60):
        x[2], x[3] = trial[0], trial[0] + path_angle
        u[0], u[1] = trial[1], trial[2]
        derivative(x, u, rigid, rates)
        rates[1] -= acceleration
        size = max(abs(rates[1]), abs(rates[2]), abs(rates[4]))
        if not np.isfinite(size):
            break
        if size >= best_size and best_size < CONVERGED:
            break  # rounding level: no further step helps
        if size < best_size:
            for i in range(3):
                unknown[i] = trial[i]
            best_size = size
        A, B = jacobian(x, u, rigid)
        for i, row in enumerate((1, 2, 4)):
            # The path angle is given: pitch angle and angle of attack change together.
            slope[i, 0] = A[row, 2] + A[row, 3]
            for j in range(N_INPUTS):
                slope[i, 1 + j] = B[row, j]
            right[i, 0] = rates[row]
        change = solve(slope, right)  # not finite where the slope is singular
        for i in range(3):
            trial[i] -= change[i, 0]
    x[2], x[3] = unknown[0], unknown[0] + path_angle
    u[0], u[1] = unknown[1], unknown[2]
    # At zero coordinates the elastic accelerations of the decoupled model are the generalised forces.
    derivative(x, u, rigid, rates)
    x[5] = rates[6] / (rigid.natural_frequency_1 * rigid.natural_frequency_1)
    x[7] = rates[8] / (rigid.natural_frequency_2 * rigid.natural_frequency_2)
    return best_size


def trim(
    vehicle: VehicleParameters,
    altitude: float,
    velocity: float,
    climb_rate: float = 0.0,
    acceleration: float = 0.0,
    where: str = "",
) -> Trim:
    """Return the equilibrium at ``altitude`` (m) and ``velocity`` (m/s) (paper eq. 5), to machine precision.

    Level and unaccelerated, or with V sin(theta - alpha) = ``climb_rate`` (m/s) and dV/dt = ``acceleration`` (m/s^2);
    angle of attack and pitch rate do not change, the vehicle does not pitch, and its elastic modes rest.

    Errors name the condition in SI, or in the words of ``where``.

    Raises:
        TrimError: No equilibrium there, or only one outside the input limits.
    """
    if not where:
        where = f"altitude = {altitude:.6g} m, velocity = {velocity:.6g} m/s"
        if climb_rate or acceleration:
            where += f", climb rate = {climb_rate:.6g} m/s, acceleration = {acceleration:.6g} m/s^2"
    if not (np.isfinite(altitude) and np.isfinite(velocity) and velocity > 0.0):
        raise TrimError(f"{where}: expected a finite altitude and a positive velocity")
    if not (abs(climb_rate) < velocity and np.isfinite(acceleration)):
        raise TrimError(f"{where}: expected a climb rate below the velocity and a finite acceleration")
    x, u = np.zeros(N_STATES), np.zeros(N_INPUTS)
    x[0], x[1] = altitude, velocity
    size = balance(vehicle.decoupled(), arcsine(climb_rate / velocity), acceleration, INITIAL_GUESS.copy(), x, u)
    check_equilibrium(where, size, u, vehicle)
    rates = np.empty(N_STATES)
    derivative(x, u, vehicle, rates)
    rates[:2] -= climb_rate, acceleration
    return Trim(x, u, float(np.max(np.abs(rates))))


def check_equilibrium(where: str, size: float, u: np.ndarray, vehicle: VehicleParameters) -> None:
    """Refuse what :func:`balance` did not balance, or only with an input ``u`` (2) outside the limits of ``vehicle``.

    Raises:
        TrimError: Says ``where`` and why.
    """
    if not size < CONVERGED:
        raise TrimError(f"{where}: no equilibrium there, expected a condition inside the trimmable envelope")
    limits = vehicle.input_minimum, vehicle.input_maximum
    for name, unit, value, low, high in zip(INPUT_NAMES, ("", " rad"), u, *limits, strict=True):
        if not low <= value <= high:
            raise TrimError(f"{where}: trim needs {name} = {value:.6g}{unit}, expected {low:.6g} to {high:.6g}{unit}")
