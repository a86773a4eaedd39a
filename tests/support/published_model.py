"""An independent implementation of the published model, in the papers' units, to check ``hsv.model``.

Parker et al., J. Guid. Control Dyn. 30(3), 2007 (numbers); equations (1)-(3) of the paper. Units: ft, slug, lbf, s,
rad; extended precision. Here the pitch acceleration is solved for first and the elastic accelerations follow; the
library does not use this order.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

FOOT = 0.3048
SLUG = 4.4482216152605 / FOOT
"""One slug in kg."""

DERIVED = (-401.9, 297.4)
PAPER_LIKE = (-100.475, 74.35)
DECOUPLED = (0.0, 0.0)

INERTIA = 5e5

STATE_UNITS = np.array([FOOT, FOOT, 1.0, 1.0, 1.0, *[SLUG**0.5 * FOOT] * 4])
"""SI value of one published unit of each state."""


def forces(x: np.ndarray, u: np.ndarray) -> tuple[float, float, float, float]:
    """Return L, D, T (lbf) and M (lbf ft), equations (2) and (3)."""
    h, v, a = x[:3]
    phi, de = u
    q_s = np.exp(-(h - 85000) / np.longdouble(21358)) * 6.7429e-5 * v**2 / 2 * 17
    lift = q_s * (4.6773 * a + 0.76224 * de - 0.018714)
    drag = q_s * (5.8224 * a**2 - 0.045315 * a + 0.81993 * de**2 + 2.7699e-4 * de + 0.010131)
    thrust = (
        (-3.7693e5 * phi - 3.7225e4) * a**3
        + (2.6814e4 * phi - 1.7277e4) * a**2
        + (3.5542e4 * phi - 2.4216e3) * a
        + (6.3785e3 * phi - 100.90)
    )
    moment = 8.36 * thrust + 17 * q_s * (6.2926 * a**2 + 2.1335 * a + 0.18979 - 1.2897 * de)
    return lift, drag, thrust, moment


def elastic_forces(x: np.ndarray, u: np.ndarray) -> tuple[float, float]:
    """Return N1 and N2 (lbf slug^-0.5), equation (2)."""
    a, de = x[2], u[1]
    return 1401.3 * a**2 + 4573.7 * a + 117.52, -5022.7 * a**2 + 2863.3 * a + 1246.5 * de - 44.201


def derivative(x: np.ndarray, u: np.ndarray, psi: tuple[float, float]) -> np.ndarray:
    """Return dx/dt of equation (1) in the papers' units; x (9) and u (2) may have extended precision."""
    _, v, a, theta, q, e1, r1, e2, r2 = x
    lift, drag, thrust, moment = forces(x, u)
    n1, n2 = elastic_forces(x, u)
    g, m = 32.174, 300
    free1 = n1 - 2 * 0.02 * 16.02 * r1 - 16.02**2 * e1
    free2 = n2 - 2 * 0.02 * 19.58 * r2 - 19.58**2 * e2
    pitch = (moment + psi[0] * free1 + psi[1] * free2) / (INERTIA + psi[0] ** 2 + psi[1] ** 2)
    return np.array(
        [
            v * np.sin(theta - a),
            (thrust * np.cos(a) - drag) / m - g * np.sin(theta - a),
            (-thrust * np.sin(a) - lift) / (m * v) + q + g / v * np.cos(theta - a),
            q,
            pitch,
            r1,
            free1 - psi[0] * pitch,
            r2,
            free2 - psi[1] * pitch,
        ]
    )


def jacobian(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """Return df/dx by central differences in extended precision, extrapolated twice (Richardson)."""
    columns = []
    for j, value in enumerate(x):
        table = []
        for halving in range(3):
            step = np.longdouble(1e-3) * max(1.0, abs(float(value))) / 2**halving
            up, down = x.astype(np.longdouble), x.astype(np.longdouble)
            up[j] += step
            down[j] -= step
            table.append((f(up) - f(down)) / (2 * step))
        first = [(4 * fine - coarse) / 3 for coarse, fine in pairwise(table)]
        columns.append((16 * first[1] - first[0]) / 15)
    return np.array(columns, float).T
