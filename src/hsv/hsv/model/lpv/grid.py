"""The decoupled models linearised at trim over the envelope, and the polytopic model with such points as vertices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hsv.model.dynamics import jacobian
from hsv.model.extended import Filter, extended_jacobian, extended_state
from hsv.model.lpv.discretisation import zero_order_hold
from hsv.model.lpv.polytope import Polytope, axis_weights
from hsv.model.trim import trim
from hsv.model.vehicle_parameters import VehicleParameters

Linearised = Callable[[float, float], tuple[np.ndarray, np.ndarray]]
"""Continuous-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s)."""


def linearise(vehicle: VehicleParameters, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous-time A (9, 9) and B (9, 2) of the decoupled model at trim (paper eq. 6 to eq. 9), SI.

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


def linearise_extended(
    vehicle: VehicleParameters, notch: Filter, altitude: float, velocity: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous-time A' (9 + k, 9 + k) and B' (9 + k, 2) of the decoupled ECM at trim (paper eq. 44), SI.

    Arguments and errors as for :func:`linearise`; ``notch``: the filter, with k states. The pitch rate that moves the
    vehicle is the true one.
    """
    rigid = vehicle.decoupled()
    equilibrium = trim(rigid, altitude, velocity)
    return extended_jacobian(extended_state(equilibrium.state, notch), equilibrium.input, rigid, notch, False)


def sample(
    model: Linearised, altitudes: np.ndarray, velocities: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return zero-order-hold A (n_h, n_v, n, n) and B (n_h, n_v, n, m) of ``model`` on a grid (paper eq. 10).

    Args:
        model: Continuous-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s).
        altitudes: (n_h) m.
        velocities: (n_v) m/s.
        period: Sampling period (s).
    """
    rows = [
        [zero_order_hold(*model(altitude, velocity), period) for velocity in velocities.tolist()]
        for altitude in altitudes.tolist()
    ]
    return np.array([[A for A, _ in row] for row in rows]), np.array([[B for _, B in row] for row in rows])


def grid_polytope(model: Linearised, altitudes: np.ndarray, velocities: np.ndarray, period: float) -> Polytope:
    """Return the polytopic model whose vertices are the discretised linearisations on a grid, weights bilinear.

    Args:
        model: Continuous-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s).
        altitudes: (n_h) m, increasing.
        velocities: (n_v) m/s, increasing.
        period: Sampling period (s).
    """
    A, B = sample(model, altitudes, velocities, period)
    n, m = B.shape[2:]
    return Polytope(
        A.reshape(-1, n, n),
        B.reshape(-1, n, m),
        axis_weights(altitudes, np.eye(len(altitudes)), "linear"),
        axis_weights(velocities, np.eye(len(velocities)), "linear"),
    )
