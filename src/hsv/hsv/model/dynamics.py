"""Equations of motion of the vehicle (paper eq. 1 to eq. 4), see ``core/vehicle.h``.

State x (9): altitude m, velocity m/s, angle of attack rad, pitch angle rad, pitch rate rad/s, elastic coordinate 1
(kg^0.5 m) and its rate, elastic coordinate 2 and its rate. Input u (2): fuel equivalence ratio, elevator rad.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from hsv.core import Struct, doubles, ffi, lib, vector
from hsv.model.vehicle_parameters import VehicleParameters

STATE_NAMES = (
    "altitude",
    "velocity",
    "angle_of_attack",
    "pitch_angle",
    "pitch_rate",
    "elastic_coordinate_1",
    "elastic_rate_1",
    "elastic_coordinate_2",
    "elastic_rate_2",
)
STATE_UNITS = ("m", "m/s", "rad", "rad", "rad/s", "kg^0.5 m", "kg^0.5 m/s", "kg^0.5 m", "kg^0.5 m/s")
INPUT_NAMES = ("fuel_equivalence_ratio", "elevator_deflection")
INPUT_UNITS = ("1", "rad")

N_STATES = len(STATE_NAMES)
N_INPUTS = len(INPUT_NAMES)
N_RIGID = 5
"""The first five states are those of the rigid body."""
PITCH_RATE = STATE_NAMES.index("pitch_rate")


@lru_cache(maxsize=64)
def vehicle_struct(vehicle: VehicleParameters) -> Struct:
    """Return the parameters as the core takes them."""
    return Struct("hsv_vehicle", vehicle)


def forces(
    x: np.ndarray, u: np.ndarray, p: VehicleParameters, conditions: np.ndarray | None = None
) -> tuple[float, float, float, float, float]:
    """Return lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa.

    Paper eq. 2, eq. 3. Lift is across the inertial path, drag along it.

    Args:
        x: State (9).
        u: Input (2).
        p: Parameters.
        conditions: Of air and engine (7): wind forward and up (m/s), density relative to the model's, factors of
            thrust, lift and drag, increment of the pitching moment coefficient; None: still air, a working engine.
    """
    found = ffi.new("double[6]")
    lib.hsv_forces(
        doubles(vector(x), N_STATES),
        doubles(vector(u), N_INPUTS),
        vehicle_struct(p).pointer,
        _conditions(conditions),
        found,
    )
    lift, drag, thrust, moment, pressure, _ = found
    return lift, drag, thrust, moment, pressure


def air_relative(velocity: float, path_angle: float, forward: float, up: float) -> tuple[float, float, float, float]:
    """Return speed (m/s) relative to air that moves forward and up (m/s), turn (rad) of its path, its sine and cosine.

    The turn is the angle from the inertial path, at ``path_angle`` (rad), to the air-relative one.
    """
    found = ffi.new("double[4]")
    lib.hsv_air_relative(velocity, path_angle, forward, up, found)
    return tuple(found)


def derivative(x: Any, u: Any, p: VehicleParameters, conditions: np.ndarray | None = None) -> np.ndarray:
    """Return dx/dt (9): the coupled model (paper eq. 1), decoupled (eq. 4) where both couplings are zero.

    A complex state or input gives a complex derivative, as the complex step needs; only in still air.
    """
    struct = vehicle_struct(p).pointer
    if np.iscomplexobj(x) or np.iscomplexobj(u):
        z, v, rates = np.array(x, complex), np.array(u, complex), np.empty(N_STATES, complex)
        lib.hsv_complex_derivative(
            doubles(z.view(float), 2 * N_STATES),
            doubles(v.view(float), 2 * N_INPUTS),
            struct,
            doubles(rates.view(float)),
        )
        return rates
    out = np.empty(N_STATES)
    lib.hsv_derivative(
        doubles(vector(x), N_STATES), doubles(vector(u), N_INPUTS), struct, _conditions(conditions), doubles(out)
    )
    return out


def jacobian(x: np.ndarray, u: np.ndarray, p: VehicleParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return A = df/dx (9, 9) and B = df/du (9, 2), by the complex step (paper eq. 6, eq. 7, eq. 8, eq. 9).

    Exact to rounding: the step is so small that its square vanishes; nothing is subtracted, truncated or cancelled.
    """
    A, B = np.empty((N_STATES, N_STATES)), np.empty((N_STATES, N_INPUTS))
    lib.hsv_jacobian(
        doubles(vector(x), N_STATES), doubles(vector(u), N_INPUTS), vehicle_struct(p).pointer, doubles(A), doubles(B)
    )
    return A, B


def advance(
    x: np.ndarray,
    u: np.ndarray,
    p: VehicleParameters,
    period: float,
    substeps: int,
    conditions: np.ndarray | None = None,
) -> np.ndarray:
    """Return the state (9) one ``period`` (s) after ``x`` (9), input ``u`` (2) held, by ``substeps`` steps of RK4.

    So are the ``conditions`` (7) of :func:`forces`, if given.
    """
    new = np.array(x, float)
    lib.hsv_advance(
        doubles(new, N_STATES),
        doubles(vector(u), N_INPUTS),
        vehicle_struct(p).pointer,
        _conditions(conditions),
        period,
        substeps,
    )
    return new


def _conditions(conditions: np.ndarray | None) -> Any:
    return ffi.NULL if conditions is None else doubles(vector(conditions), lib.CONDITIONS)
