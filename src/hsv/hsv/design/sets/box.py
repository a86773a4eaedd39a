"""The paper's box set (eq. 25 to eq. 28): the linear programme it is, and why it has no solution here.

For Z = {|e| <= z} and a box of disturbances, condition (27) asks of every row a of every A_i + B_i F that the largest
of a'e + d over Z and W is at most z_j. By the Farkas lemma (the paper's Lemma 2) this holds if and only if there are
multipliers p, m >= 0 of the faces e <= z and -e <= z with p - m = a and (p + m)'z + w_j <= z_j; the least p + m is |a|,
so the multipliers of (28) can be eliminated:

    minimise sum z   subject to   |A_i + B_i F| z + w_i <= z  at every vertex,  z >= 0,   a linear programme.

It is infeasible if and only if (Farkas again) there are y_i >= 0 with sum_i (I - |A_i + B_i F|)' y_i <= 0 and
sum_i w_i' y_i > 0. One vertex with a spectral radius of |A_i + B_i F| of at least one is enough for that: its left
Perron vector is such a y_i. Integrators and oscillating pairs lose their sign in the absolute value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from hsv.base.errors import DesignError
from hsv.control.optimisation import spectral_radii
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem


@dataclass(frozen=True)
class BoxSet(InvariantSet):
    """{c + e: |e| <= z}."""

    kind = "box"

    def level(self, error: np.ndarray) -> np.ndarray:
        """Return the largest ratio of a component of e - c to its half-width, squared."""
        return np.asarray(np.max(np.abs(error - self.centre) / self.half_width, axis=-1) ** 2)

    def certify(self) -> dict[str, Any]:
        """Recompute (27) at every vertex."""
        A, w = _absolute(self.problem, self.centre)
        residuals = (self.half_width - A @ self.half_width - w).min(axis=1)
        if not residuals.min() >= 0.0:
            raise DesignError(f"box: vertex {int(np.argmin(residuals))} leaves the set by {-residuals.min():.3g}")
        return {"smallest_residuals": residuals.tolist()}


@dataclass(frozen=True)
class Infeasibility:
    """Proof that no box exists: ``multipliers`` y (r, n), their result, and the spectral radii that explain it.

    ``columns`` is the largest entry of sum_i (I - |A_i|)' y_i, at most zero; ``gain`` is sum_i w_i' y_i, above zero;
    ``radii`` (r) of |A_i + B_i F|; ``radius`` of their elementwise maximum.
    """

    multipliers: np.ndarray
    columns: float
    gain: float
    radii: np.ndarray
    radius: float

    def report(self) -> dict[str, Any]:
        """Return the certificate for JSON."""
        return {
            "multipliers": self.multipliers.tolist(),
            "largest_column": self.columns,
            "gain": self.gain,
            "spectral_radii": self.radii.tolist(),
            "spectral_radius_of_maximum": self.radius,
        }


def box(problem: TubeProblem) -> BoxSet:
    """Return the least invariant box (paper eq. 25, eq. 26, eq. 27, eq. 28).

    Raises:
        DesignError: There is none; the message gives the spectral radius.
    """
    centre = problem.centre()
    A, w = _absolute(problem, centre)
    r, n = w.shape
    # Scaled by one step's disturbance, so that the programme has entries near one.
    scale = np.maximum(w.max(axis=0), 1e-12)
    rows = (np.eye(n) - A) * scale
    rows = (rows / scale[:, None]).reshape(r * n, n)
    found = linprog(np.ones(n), A_ub=-rows, b_ub=-(w / scale).reshape(-1), bounds=(0.0, None), method="highs")
    if found.status != 0:
        proof = infeasibility(problem)
        raise DesignError(
            f"box: infeasible ({proof.multipliers.shape[0]} vertices, spectral radius of max |A_i + B_i F| "
            f"{proof.radius:.4f}, of single vertices {proof.radii.min():.4f} to {proof.radii.max():.4f}), "
            "expected below 1"
        )
    z = scale * found.x * (1.0 + 1e-9)
    return BoxSet(problem, centre, z, np.abs(problem.system.F) @ z)


def infeasibility(problem: TubeProblem) -> Infeasibility:
    """Return multipliers that prove that no box is invariant, verified.

    Raises:
        DesignError: No vertex has a spectral radius above one, so that this proof is not available.
    """
    A, w = _absolute(problem, problem.centre())
    radii = spectral_radii(A)
    worst = int(np.argmax(radii))
    values, vectors = np.linalg.eig(A[worst].T)
    left = np.abs(np.real(vectors[:, int(np.argmax(np.abs(values)))]))
    multipliers = np.zeros(w.shape)
    # In units of one step's disturbance.
    multipliers[worst] = left / float(w[worst] @ left)
    columns = (np.eye(len(left)) - A[worst]).T @ multipliers[worst]
    size = float(columns.max() / multipliers.max())
    gain = float(np.sum(w * multipliers))
    if not (radii[worst] >= 1.0 and size <= 1e-9 and gain > 0.0):
        raise DesignError(f"box: spectral radius {radii[worst]:.6f}: infeasibility not shown")
    return Infeasibility(multipliers, size, gain, radii, float(spectral_radii(A.max(axis=0)[None])[0]))


def _absolute(problem: TubeProblem, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |A_i + B_i F| (r, n, n) and the half-widths w_i (r, n) of one step's disturbance."""
    return np.abs(problem.system.A), np.abs(problem.columns(centre)).sum(axis=2)
