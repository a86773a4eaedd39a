"""Linear models of the vehicle at trim: discretisation, extended states, modes and frequency responses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hsv.base.errors import DesignError
from hsv.model.dynamics import VehicleParameters, derivative, jacobian
from hsv.model.signals import ACCELERATED, N_INPUTS, N_RIGID, N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


def zero_order_hold(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete A (n, n) and B (n, m) of dx/dt = A x + B u with u held over ``period`` (paper eq. 12).

    Args:
        A: (n, n) continuous-time state matrix, SI per second.
        B: (n, m) continuous-time input matrix; its columns may include disturbances.
        period: Sampling period (s).
    """
    # Imported here because scipy.linalg would dominate the start of a node, which does not need it.
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n] = A
    block[:n, n:] = B
    transition = expm(block * period)
    return transition[:n, :n], transition[:n, n:]


class Filter(NamedTuple):
    """A continuous-time filter of the pitch rate (paper eq. 39): A (k, k), B (k,), C (k,) and a non-zero D."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: float


def extended_derivative(x: np.ndarray, u: np.ndarray, p: VehicleParameters, notch: Filter, printed: bool) -> np.ndarray:
    """Return the time derivative, shape (9 + k,), of the extended state, vehicle and filter (paper eq. 40).

    Args:
        x: Extended state, shape (9 + k,), with the filtered pitch rate in place of the true one, real or complex.
        u: Inputs, shape (2,), real or complex.
        p: Vehicle.
        notch: Filter with k states.
        printed: True: the filtered pitch rate moves the vehicle, as the paper prints it; False: the true one does.
    """
    filtered, s = x[PITCH_RATE], x[N_STATES:]
    passed = 0.0 * filtered
    for c, value in zip(notch.C, s, strict=True):
        passed += c * value
    # Python divides both parts of a complex number; numpy multiplies them by the inverse, with other last bits.
    rate = (filtered - passed).item() / float(notch.D)
    vehicle = x[:N_STATES].copy()
    vehicle[PITCH_RATE] = rate
    out = derivative(vehicle, u, p)
    if printed:
        out[2] += filtered - rate
        out[3] = filtered
    out[PITCH_RATE] *= notch.D
    change = notch.B * rate
    for column, value in zip(notch.A.T, s, strict=True):
        change = change + column * value
    for c, value in zip(notch.C, change, strict=True):
        out[PITCH_RATE] += c * value
    return np.concatenate((out, change))


def extended_jacobian(
    x: np.ndarray, u: np.ndarray, p: VehicleParameters, notch: Filter, printed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the Jacobians A' (9 + k, 9 + k) and B' (9 + k, 2) by the complex step (paper eq. 42, eq. 43).

    Arguments as for :func:`extended_derivative`.
    """
    step = 1e-40
    n = len(x)
    columns = []
    for change in 1j * step * np.eye(n + N_INPUTS):
        rates = extended_derivative(x + change[:n], u + change[n:], p, notch, printed)
        columns.append(rates.imag / step)
    both = np.array(columns).T
    return both[:, :n].copy(), both[:, n:].copy()


def extended_state(x: np.ndarray, notch: Filter) -> np.ndarray:
    """Return the extended state, shape (9 + k,), of a vehicle state ``x`` if the filter is in equilibrium (eq. 41)."""
    rest = np.linalg.solve(-notch.A, notch.B * x[PITCH_RATE])
    extended = np.concatenate((x, rest))
    extended[PITCH_RATE] = notch.C @ rest + notch.D * x[PITCH_RATE]
    return extended


def from_true_rate(notch: Filter) -> np.ndarray:
    """Return T (9 + k, 9 + k), which maps an extended state with the true pitch rate to one with the filtered rate."""
    T = np.eye(N_STATES + len(notch.B))
    T[PITCH_RATE, PITCH_RATE] = notch.D
    T[PITCH_RATE, N_STATES:] = notch.C
    return T


Linearised = Callable[[float, float], tuple[np.ndarray, np.ndarray]]
"""Continuous-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s)."""


def linearise(vehicle: VehicleParameters, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous-time A (9, 9) and B (9, 2) of the decoupled model at trim (paper eq. 6 to eq. 9), SI.

    Args:
        vehicle: Parameters of the vehicle; their inertial coupling is ignored.
        altitude: Altitude of the trim, m.
        velocity: Velocity of the trim, m/s.

    Raises:
        TrimError: There is no equilibrium at this altitude and velocity within the input limits.
    """
    rigid = vehicle.decoupled()
    equilibrium = trim(rigid, altitude, velocity)
    return jacobian(equilibrium.state, equilibrium.input, rigid)


def acceleration_channels(vehicle: Vehicle, period: float) -> np.ndarray:
    """Return the change (5, 3) of the rigid states by each unit acceleration held for ``period`` (s), mid-envelope."""
    A, _ = linearise(vehicle.decoupled, *vehicle.centre)
    unit = np.zeros((N_RIGID, 3))
    unit[ACCELERATED, [0, 1, 2]] = 1.0
    return zero_order_hold(A[:N_RIGID, :N_RIGID], unit, period)[1]


def linearise_extended(
    vehicle: VehicleParameters, notch: Filter, altitude: float, velocity: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous-time A' (9 + k, 9 + k) and B' (9 + k, 2) of vehicle and filter at trim (paper eq. 44).

    The vehicle is decoupled, and the true pitch rate moves it. Units, arguments and errors are those of
    :func:`linearise`; ``notch`` is the filter with k states.
    """
    rigid = vehicle.decoupled()
    equilibrium = trim(rigid, altitude, velocity)
    return extended_jacobian(extended_state(equilibrium.state, notch), equilibrium.input, rigid, notch, False)


def sample(
    model: Linearised, altitudes: np.ndarray, velocities: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return A (n_h, n_v, n, n) and B (n_h, n_v, n, m) of ``model`` with zero-order hold on a grid (paper eq. 10).

    Args:
        model: Continuous-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s).
        altitudes: Altitudes (m), shape (n_h,).
        velocities: Velocities (m/s), shape (n_v,).
        period: Sampling period (s).
    """
    rows = [
        [zero_order_hold(*model(altitude, velocity), period) for velocity in velocities.tolist()]
        for altitude in altitudes.tolist()
    ]
    return np.array([[A for A, _ in row] for row in rows]), np.array([[B for _, B in row] for row in rows])


@dataclass(frozen=True)
class Mode:
    """A mode: its pole (rad/s; of a complex pair the upper one), natural frequency (rad/s) and damping ratio."""

    pole: complex
    natural_frequency: float
    damping_ratio: float


def modes(A: np.ndarray) -> list[Mode]:
    """Return the modes of ``A`` (n, n), highest frequency first; an unstable real pole has the damping ratio -1."""
    return as_modes(np.linalg.eigvals(A))


def as_modes(poles: np.ndarray) -> list[Mode]:
    """Return poles or zeros (rad/s), shape (n,), as modes: one for each complex pair, highest frequency first."""
    found = []
    for pole in poles.tolist():
        if pole.imag >= 0.0:
            frequency = abs(pole)
            found.append(Mode(complex(pole), frequency, -complex(pole).real / frequency if frequency else 0.0))
    return sorted(found, key=lambda mode: -mode.natural_frequency)


def frequency_response(
    A: np.ndarray, B: np.ndarray, frequencies: np.ndarray, period: float | None = None
) -> np.ndarray:
    """Return the complex frequency response, shape (f, n, m), of all states to all inputs.

    Args:
        A: (n, n) state matrix.
        B: (n, m) input matrix.
        frequencies: Frequencies (rad/s), shape (f,).
        period: Sampling period (s) of a discrete-time model, ``None`` for a continuous one.

    Raises:
        DesignError: A frequency is at or above the Nyquist frequency of a discrete-time model.
    """
    if period is not None and np.max(frequencies) >= math.pi / period:
        nyquist = math.pi / period
        raise DesignError(
            f"frequency {np.max(frequencies):.6g} rad/s: expected less than the Nyquist frequency {nyquist:.6g} rad/s"
        )
    s = 1j * np.asarray(frequencies, float)
    z = s if period is None else np.exp(s * period)
    return np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B.astype(complex))


def bode(response: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return magnitude (dB) and phase (deg, unwrapped along the first axis) of a complex response."""
    return 20.0 * np.log10(np.abs(response)), np.degrees(np.unwrap(np.angle(response), axis=0))


def bode_difference(response: np.ndarray, expected: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the absolute differences of magnitude (dB) and phase (deg, at most 180) of two complex responses.

    Two responses of zero, such as those of the elastic states of a rigid vehicle, count as equal.
    """
    ratio = np.divide(response, expected, out=np.ones_like(response), where=(response != 0.0) | (expected != 0.0))
    return np.abs(20.0 * np.log10(np.abs(ratio))), np.abs(np.degrees(np.angle(ratio)))
