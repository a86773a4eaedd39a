"""Equilibrium of level flight at a given altitude and velocity (paper eq. 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.errors import TrimError
from hsv.vehicle.dynamics import N_STATES, derivative, jacobian
from hsv.vehicle.envelope import INPUT_MAXIMUM, INPUT_MINIMUM
from hsv.vehicle.parameters import VehicleParameters

_BALANCED = (1, 2, 4)
"""The equations to bring to zero: velocity, angle of attack and pitch rate."""


@dataclass(frozen=True)
class Trim:
    """An equilibrium: ``state`` (9) and ``input`` (2), SI, and the largest remaining |dx/dt| in SI units per second."""

    state: np.ndarray
    input: np.ndarray
    residual: float


def trim(vehicle: VehicleParameters, altitude: float, velocity: float) -> Trim:
    """Return the level, unaccelerated flight at ``altitude`` (m) and ``velocity`` (m/s), to machine precision.

    Newton's method in angle of attack, fuel equivalence ratio and elevator deflection with exact derivatives. The
    elastic coordinates follow: with zero pitching moment they are N_i / omega_i^2, whatever the inertial coupling.

    Raises:
        TrimError: No equilibrium there, or only one outside the input limits.
    """
    where = f"altitude = {altitude:.6g} m, velocity = {velocity:.6g} m/s"
    if not (np.isfinite(altitude) and np.isfinite(velocity) and velocity > 0.0):
        raise TrimError(f"{where}: expected a finite altitude and a positive velocity")
    rigid = vehicle.decoupled()
    x = np.zeros(N_STATES)
    x[0], x[1] = altitude, velocity
    u = np.zeros(2)
    unknown = np.array([0.03, 0.3, 0.2])
    rates = np.empty(N_STATES)
    best, best_size = unknown, np.inf
    for _ in range(60):
        x[2] = x[3] = unknown[0]
        u[:] = unknown[1:]
        derivative(x, u, rigid, rates)
        size = float(np.max(np.abs(rates[list(_BALANCED)])))
        if not np.isfinite(size):
            break
        if size >= best_size and best_size < 1e-9:
            break  # rounding level: no further step helps
        if size < best_size:
            best, best_size = unknown.copy(), size
        A, B = jacobian(x, u, rigid)
        # Level flight couples pitch angle to angle of attack.
        slope = np.column_stack((A[:, 2] + A[:, 3], B))[list(_BALANCED)]
        try:
            unknown = unknown - np.linalg.solve(slope, rates[list(_BALANCED)])
        except np.linalg.LinAlgError:
            break
    if not best_size < 1e-9:
        raise TrimError(f"{where}: no level equilibrium there, expected a condition inside the trimmable envelope")
    x[2] = x[3] = best[0]
    u = best[1:].copy()
    for name, value, low, high in zip(
        ("fuel_equivalence_ratio", "elevator_deflection"), u, INPUT_MINIMUM, INPUT_MAXIMUM, strict=True
    ):
        if not low <= value <= high:
            raise TrimError(f"{where}: trim needs {name} = {value:.6g}, expected {low:.6g} to {high:.6g}")
    # At zero coordinates the elastic accelerations of the decoupled model are the generalised forces.
    derivative(x, u, rigid, rates)
    x[5] = rates[6] / vehicle.natural_frequency_1**2
    x[7] = rates[8] / vehicle.natural_frequency_2**2
    derivative(x, u, vehicle, rates)
    return Trim(x, u, float(np.max(np.abs(rates))))
