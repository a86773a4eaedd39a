"""Extended states coupling model (ECM, paper eq. 39 to eq. 43): the vehicle with a linear filter on its pitch rate.

State x' (9 + k): that of the vehicle with the filtered pitch rate q' in place of q, then the k states s of the filter.
q' = C s + D q, so that q = (q' - C s) / D; the vehicle's own equations are those of :mod:`hsv.vehicle.dynamics`.

The paper prints q' where the kinematics of angle of attack and pitch angle have q (eq. 40): a filter in a sensor does
not move the vehicle. ``printed`` selects that reading; the other is the physical one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit
from hsv.vehicle.dynamics import N_INPUTS, N_STATES, PITCH_RATE, derivative
from hsv.vehicle.parameters import VehicleParameters


class Filter(NamedTuple):
    """A continuous-time filter of the pitch rate (paper eq. 39): A (k, k), B (k), C (k), D not zero."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: float


@njit(cache=True, error_model="numpy")
def extended_derivative(x: Any, u: Any, p: Any, notch: Any, printed: bool, out: Any) -> None:
    """Write dx'/dt into ``out`` (9 + k) (paper eq. 40); complex arguments are taken, too."""
    filtered = x[PITCH_RATE]
    vehicle = x[:N_STATES].copy()
    passed = 0.0 * filtered
    for i in range(len(notch.B)):
        passed += notch.C[i] * x[N_STATES + i]
    rate = (filtered - passed) / notch.D
    vehicle[PITCH_RATE] = rate
    derivative(vehicle, u, p, out)
    if printed:
        out[2] += filtered - rate
        out[3] = filtered
    out[PITCH_RATE] *= notch.D
    for i in range(len(notch.B)):
        change = notch.B[i] * rate
        for j in range(len(notch.B)):
            change += notch.A[i, j] * x[N_STATES + j]
        out[N_STATES + i] = change
        out[PITCH_RATE] += notch.C[i] * change


@njit(cache=True, error_model="numpy")
def extended_jacobian(
    x: np.ndarray, u: np.ndarray, p: VehicleParameters, notch: Any, printed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return A' (9 + k, 9 + k) and B' (9 + k, 2) (paper eq. 42, eq. 43), by the complex step."""
    step = 1e-40
    n = len(x)
    A, B = np.empty((n, n)), np.empty((n, N_INPUTS))
    z, v = x.astype(np.complex128), u.astype(np.complex128)
    out = np.empty(n, np.complex128)
    for j in range(n):
        z[j] += 1j * step
        extended_derivative(z, v, p, notch, printed, out)
        A[:, j] = out.imag / step
        z[j] = x[j]
    for j in range(N_INPUTS):
        v[j] += 1j * step
        extended_derivative(z, v, p, notch, printed, out)
        B[:, j] = out.imag / step
        v[j] = u[j]
    return A, B


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
