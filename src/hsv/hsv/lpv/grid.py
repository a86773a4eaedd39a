"""The decoupled model linearised at trim over the envelope, and the polytopic model with those points as vertices."""

from __future__ import annotations

import numpy as np

from hsv.lpv.discretisation import zero_order_hold
from hsv.lpv.polytope import Polytope, axis_weights
from hsv.vehicle.dynamics import N_INPUTS, N_STATES, jacobian
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.trim import trim


def linearise(vehicle: VehicleParameters, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous-time A (9, 9) and B (9, 2) of the decoupled model at trim (paper eq. 4-9), SI.

    Args:
        vehicle: Parameters; their inertial coupling is left out.
        altitude: m.
        velocity: m/s.

    Raises:
        TrimError: No equilibrium there.
    """
    rigid = vehicle.decoupled()
    equilibrium = trim(rigid, altitude, velocity)
    return jacobian(equilibrium.state, equilibrium.input, rigid)


def sample(
    vehicle: VehicleParameters, altitudes: np.ndarray, velocities: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return zero-order-hold A (n_h, n_v, 9, 9) and B (n_h, n_v, 9, 2) of the decoupled model on a grid.

    Args:
        vehicle: Parameters; their inertial coupling is left out.
        altitudes: (n_h) m.
        velocities: (n_v) m/s.
        period: Sampling period (s).
    """
    shape = (len(altitudes), len(velocities))
    A = np.empty((*shape, N_STATES, N_STATES))
    B = np.empty((*shape, N_STATES, N_INPUTS))
    for i, altitude in enumerate(altitudes):
        for j, velocity in enumerate(velocities):
            A[i, j], B[i, j] = zero_order_hold(*linearise(vehicle, float(altitude), float(velocity)), period)
    return A, B


def grid_polytope(vehicle: VehicleParameters, altitudes: np.ndarray, velocities: np.ndarray, period: float) -> Polytope:
    """Return the polytopic model whose vertices are the discretised linearisations on a grid, weights bilinear.

    Args:
        vehicle: Parameters; their inertial coupling is left out.
        altitudes: (n_h) m, increasing.
        velocities: (n_v) m/s, increasing.
        period: Sampling period (s).
    """
    A, B = sample(vehicle, altitudes, velocities, period)
    return Polytope(
        A.reshape(-1, N_STATES, N_STATES),
        B.reshape(-1, N_STATES, N_INPUTS),
        axis_weights(altitudes, np.eye(len(altitudes)), "linear"),
        axis_weights(velocities, np.eye(len(velocities)), "linear"),
    )
