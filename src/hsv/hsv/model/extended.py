"""Extended states coupling model (ECM, paper eq. 39 to eq. 43): the vehicle with a linear filter on its pitch rate.

State x' (9 + k): that of the vehicle with the filtered pitch rate q' in place of q, then the k states s of the filter.
q' = C s + D q, so that q = (q' - C s) / D; the vehicle's own equations are those of :mod:`hsv.model.dynamics`.

The paper prints q' where the kinematics of angle of attack and pitch angle have q (eq. 40): a filter in a sensor does
not move the vehicle. ``printed`` selects that reading; the other is the physical one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hsv.model.dynamics import N_INPUTS, N_STATES, PITCH_RATE, derivative
from hsv.model.vehicle_parameters import VehicleParameters


class Filter(NamedTuple):
    """A continuous-time filter of the pitch rate (paper eq. 39): A (k, k), B (k), C (k), D not zero."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: float


def extended_derivative(x: np.ndarray, u: np.ndarray, p: VehicleParameters, notch: Filter, printed: bool) -> np.ndarray:
    """Return dx'/dt (9 + k) (paper eq. 40), complex where ``x`` (9 + k) or ``u`` (2) is."""
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
    """Return A' (9 + k, 9 + k) and B' (9 + k, 2) (paper eq. 42, eq. 43), by the complex step."""
    step = 1e-40
    n = len(x)
    columns = []
    for change in 1j * step * np.eye(n + N_INPUTS):
        rates = extended_derivative(x + change[:n], u + change[n:], p, notch, printed)
        columns.append(rates.imag / step)
    both = np.array(columns).T
    return both[:, :n].copy(), both[:, n:].copy()


def extended_state(x: np.ndarray, notch: Filter) -> np.ndarray:
    """Return x' (9 + k) of a vehicle state ``x`` (9), the filter at rest: an equilibrium if x is one (eq. 41)."""
    rest = np.linalg.solve(-notch.A, notch.B * x[PITCH_RATE])
    extended = np.concatenate((x, rest))
    extended[PITCH_RATE] = notch.C @ rest + notch.D * x[PITCH_RATE]
    return extended


def from_true_rate(notch: Filter) -> np.ndarray:
    """Return T (9 + k, 9 + k) with x' = T x, where x has the true pitch rate in place of the filtered one."""
    T = np.eye(N_STATES + len(notch.B))
    T[PITCH_RATE, PITCH_RATE] = notch.D
    T[PITCH_RATE, N_STATES:] = notch.C
    return T
