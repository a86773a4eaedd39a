"""The paper's box set (eq. 25 to eq. 28), and why it does not exist here.

For Z = {|e| <= z} and a box of disturbances, condition (27) asks of every row a of every A_i + B_i F that the largest
of a'e + d over Z and W is at most z_j. By the Farkas lemma (the paper's Lemma 2) this is a linear programme,

    minimise sum z   subject to   |A_i + B_i F| z + w_i <= z  at every vertex,  z >= 0,

which is infeasible if and only if (Farkas again) there are y_i >= 0 with sum_i (I - |A_i + B_i F|)' y_i <= 0 and
sum_i w_i' y_i > 0. One vertex with a spectral radius of |A_i + B_i F| of at least one is enough for that: its left
Perron vector is such a y_i. Integrators and oscillating pairs lose their sign in the absolute value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Infeasibility:
    """Proof that no box exists, valid where ``column`` is at most zero (to rounding) and ``gain`` is above zero.

    ``multipliers`` y (n) of the worst ``vertex``; ``column``: the largest entry of (I - |A_i|)' y over that of y;
    ``gain``: w_i' y; ``radius``: spectral radius of the elementwise maximum of all |A_i + B_i F|.
    """

    vertex: int
    multipliers: np.ndarray
    column: float
    gain: float
    radius: float


def infeasibility(closed: np.ndarray, disturbance: np.ndarray) -> Infeasibility:
    """Return the proof for closed loops A_i + B_i F (r, n, n) and the half-widths (n) of one step's disturbance."""
    A = np.abs(closed)
    radii = np.abs(np.linalg.eigvals(A)).max(axis=1)
    worst = int(np.argmax(radii))
    values, vectors = np.linalg.eig(A[worst].T)
    y = np.abs(np.real(vectors[:, int(np.argmax(np.abs(values)))]))
    column = float(((np.eye(len(y)) - A[worst]).T @ y).max() / y.max())
    radius = float(np.abs(np.linalg.eigvals(A.max(axis=0))).max())
    return Infeasibility(worst, y, column, float(disturbance @ y), radius)
