"""Equations of motion of the vehicle (paper eq. 1 to eq. 4), compiled; one function for coupled and decoupled model.

State x (9): altitude m, velocity m/s, angle of attack rad, pitch angle rad, pitch rate rad/s, elastic coordinate 1
(kg^0.5 m) and its rate, elastic coordinate 2 and its rate. Input u (2): fuel equivalence ratio, elevator rad.
The functions accept complex arguments, so that derivatives can be taken by the complex step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.compiled import njit, njit_in_flight
from hsv.elementary import arctangent2, exponential, sine_cosine
from hsv.vehicle.parameters import VehicleParameters

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


@njit_in_flight(error_model="numpy", inline="always")
def forces(x: Any, u: Any, p: Any) -> Any:
    """Return lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa (paper eq. 2, eq. 3).

    The thrust term of the moment is z_T T and the density exponent -(h - h_0) / h_s; the paper prints both otherwise.
    """
    altitude, velocity, alpha = x[0], x[1], x[2]
    fuel, elevator = u[0], u[1]
    density = p.reference_density * exponential(-(altitude - p.reference_altitude) / p.density_scale_height)
    pressure = 0.5 * density * velocity * velocity
    alpha2 = alpha * alpha
    lift = pressure * p.reference_area * (p.lift_alpha * alpha + p.lift_elevator * elevator + p.lift_zero)
    drag = (
        pressure
        * p.reference_area
        * (
            p.drag_alpha_squared * alpha2
            + p.drag_alpha * alpha
            + p.drag_elevator_squared * elevator * elevator
            + p.drag_elevator * elevator
            + p.drag_zero
        )
    )
    thrust = (
        (p.thrust_beta_1 * fuel + p.thrust_beta_2) * alpha2 * alpha
        + (p.thrust_beta_3 * fuel + p.thrust_beta_4) * alpha2
        + (p.thrust_beta_5 * fuel + p.thrust_beta_6) * alpha
        + (p.thrust_beta_7 * fuel + p.thrust_beta_8)
    )
    moment = p.thrust_moment_arm * thrust + pressure * p.reference_area * p.mean_aerodynamic_chord * (
        p.moment_alpha_squared * alpha2 + p.moment_alpha * alpha + p.moment_zero + p.moment_elevator * elevator
    )
    return lift, drag, thrust, moment, pressure


@njit_in_flight(error_model="numpy")
def air_relative(velocity: Any, path_angle: Any, wind_x: float, wind_z: float) -> Any:
    """Return speed (m/s) relative to moving air, turn (rad) of its path from the inertial one, its sine and cosine.

    That is V_a and e = gamma_a - gamma for air that moves at ``wind_x`` forward and ``wind_z`` up (m/s).
    """
    sin, cos = sine_cosine(path_angle)
    along = velocity - (wind_x * cos + wind_z * sin)
    across = wind_x * sin - wind_z * cos
    speed = np.sqrt(along * along + across * across)
    return speed, arctangent2(across, along), across / speed, along / speed


@njit_in_flight(error_model="numpy")
def forces_in(conditions: Any, x: Any, u: Any, p: Any) -> Any:
    """Return lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa, and angle of attack rad of the air.

    Lift is across the inertial path and drag along it: those of the air, turned by the angle between the two paths.

    Args:
        conditions: (7): wind forward and up (m/s), density for that of the model, factors of thrust, lift and drag,
            increment of the pitching moment coefficient. The thrust does not depend on the density.
        x: State (9), inertial.
        u: Input (2).
        p: Parameters.
    """
    speed, turn, sin, cos = air_relative(x[1], x[3] - x[2], conditions[0], conditions[1])
    alpha = x[2] - turn
    lift, drag, thrust, moment, pressure = forces((x[0], speed, alpha), u, p)
    moment = conditions[2] * (
        moment - p.thrust_moment_arm * thrust + pressure * p.reference_area * p.mean_aerodynamic_chord * conditions[6]
    )
    thrust *= conditions[3]
    lift *= conditions[2] * conditions[4]
    drag *= conditions[2] * conditions[5]
    return (
        lift * cos - drag * sin,
        drag * cos + lift * sin,
        thrust,
        moment + p.thrust_moment_arm * thrust,
        conditions[2] * pressure,
        alpha,
    )


# Inlined, as is all that is called in every step: a call takes a reference to each array, a tenth of the step's time.
@njit_in_flight(error_model="numpy", inline="always")
def derivative(x: Any, u: Any, p: Any, out: Any, conditions: Any = None) -> None:
    """Write dx/dt into ``out`` (9): the coupled model (paper eq. 1), decoupled (eq. 4) where both couplings are zero.

    The two elastic accelerations appear in each other's equation; the 2x2 system is solved exactly. Velocity and angle
    of attack, pitch angle less path angle, are inertial.

    Args:
        x: State (9).
        u: Input (2).
        p: Parameters.
        out: Written.
        conditions: Of air and engine (7), see :func:`forces_in`; none: still air and an engine that works.
    """
    velocity, alpha, pitch, rate = x[1], x[2], x[3], x[4]
    if conditions is None:
        lift, drag, thrust, moment, _ = forces(x, u, p)
    else:
        lift, drag, thrust, moment, _, alpha = forces_in(conditions, x, u, p)
    alpha2 = alpha * alpha
    force_1 = p.elastic_force_1_alpha_squared * alpha2 + p.elastic_force_1_alpha * alpha + p.elastic_force_1_zero
    force_2 = (
        p.elastic_force_2_alpha_squared * alpha2
        + p.elastic_force_2_alpha * alpha
        + p.elastic_force_2_elevator * u[1]
        + p.elastic_force_2_zero
    )
    psi_1, psi_2 = p.inertial_coupling_1, p.inertial_coupling_2
    omega_1, omega_2 = p.natural_frequency_1, p.natural_frequency_2
    # Couplings and moment for the moment of inertia.
    c_1, c_2 = psi_1 / p.moment_of_inertia, psi_2 / p.moment_of_inertia
    angular = moment / p.moment_of_inertia
    k_1, k_2, k_12 = 1.0 + psi_1 * c_1, 1.0 + psi_2 * c_2, psi_1 * c_2
    right_1 = -2.0 * p.damping_ratio_1 * omega_1 * x[6] - omega_1 * omega_1 * x[5] + force_1 - psi_1 * angular
    right_2 = -2.0 * p.damping_ratio_2 * omega_2 * x[8] - omega_2 * omega_2 * x[7] + force_2 - psi_2 * angular
    determinant = k_1 * k_2 - k_12 * k_12
    acceleration_1 = (k_2 * right_1 - k_12 * right_2) / determinant
    acceleration_2 = (k_1 * right_2 - k_12 * right_1) / determinant

    alpha = x[2]
    sin_alpha, cos_alpha = sine_cosine(alpha)
    sin_path, cos_path = sine_cosine(pitch - alpha)
    out[0] = velocity * sin_path
    out[1] = (thrust * cos_alpha - drag) / p.mass - p.gravity * sin_path
    out[2] = (-thrust * sin_alpha - lift) / (p.mass * velocity) + rate + p.gravity / velocity * cos_path
    out[3] = rate
    out[4] = angular + c_1 * acceleration_1 + c_2 * acceleration_2
    out[5] = x[6]
    out[6] = acceleration_1
    out[7] = x[8]
    out[8] = acceleration_2


@njit(cache=True, error_model="numpy")
def jacobian(x: np.ndarray, u: np.ndarray, p: VehicleParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return A = df/dx (9, 9) and B = df/du (9, 2), by the complex step (paper eq. 6, eq. 7, eq. 8, eq. 9).

    Exact to rounding: the step is so small that its square vanishes; nothing is subtracted, truncated or cancelled.
    """
    step = 1e-40
    A = np.empty((N_STATES, N_STATES))
    B = np.empty((N_STATES, N_INPUTS))
    z = x.astype(np.complex128)
    v = u.astype(np.complex128)
    out = np.empty(N_STATES, np.complex128)
    for j in range(N_STATES):
        z[j] += 1j * step
        derivative(z, v, p, out)
        A[:, j] = out.imag / step
        z[j] = x[j]
    for j in range(N_INPUTS):
        v[j] += 1j * step
        derivative(z, v, p, out)
        B[:, j] = out.imag / step
        v[j] = u[j]
    return A, B
