"""Quadratic Lyapunov functions of many closed loops: whatever switches between them, the error decays (eq. 24)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_discrete_lyapunov

from hsv.base.errors import DesignError
from hsv.control.optimisation import SolverReport, Unknown, image, minimise, rounded_matrix, spectral_radii

_CONDITION = 1e3
"""Bound on the condition number of N, whitened, without which the largest margin is not attained."""


def lyapunov_residuals(closed_loop: np.ndarray, N: np.ndarray, name: str) -> np.ndarray:
    """Return the smallest eigenvalue (r) of [N, (A_c N)'; A_c N, N] at each vertex, where N is scaled to the identity.

    Args:
        closed_loop: (r, n, n) A_i + B_i F.
        N: (n, n) the matrix of (24).
        name: Name of what is verified, for the error message.

    Raises:
        DesignError: N is not positive definite, or an eigenvalue is not positive.
    """
    residuals = 1.0 - image(N, f"{name}: N", closed_loop)
    worst = int(np.argmin(residuals))
    if not residuals[worst] > 0.0:
        raise DesignError(
            f"{name}: smallest eigenvalue at vertex {worst} = {residuals[worst]:.3g}, expected above zero"
        )
    return residuals


@dataclass(frozen=True)
class CommonLyapunov:
    """e' N^-1 e decreases in every loop: ``N`` (n, n) SI, ``residuals`` (r) as in :func:`lyapunov_residuals`."""

    N: np.ndarray
    residuals: np.ndarray
    solver: SolverReport

    def report(self) -> dict[str, Any]:
        """Return the matrix and its evidence, for JSON."""
        return {
            "N": self.N.tolist(),
            "lmi_smallest_eigenvalues": self.residuals.tolist(),
            "solver": self.solver.as_dict(),
        }


def common_lyapunov(closed_loop: np.ndarray, scale: np.ndarray, name: str) -> CommonLyapunov:
    """Return the function with the largest margin, verified after solving.

    Args:
        closed_loop: (r, n, n) discrete-time state matrices.
        scale: (n) sizes of the states that count as equal, SI.
        name: Name of what is certified, for the error message.

    Raises:
        DesignError: No solution, or one that fails (24) when recomputed.
    """
    mean = closed_loop.mean(axis=0)
    radius = float(spectral_radii(mean[None])[0])
    if not radius < 1.0:
        raise DesignError(f"{name}: spectral radius {radius:.6g} of the mean of the loops, expected below 1")
    L = cholesky(solve_discrete_lyapunov(mean, np.diag(scale**2)), lower=True)
    white = np.linalg.solve(L, closed_loop @ L)
    n = len(mean)

    def inequalities(N: np.ndarray, margin: np.ndarray) -> list[np.ndarray]:
        blocks = [N - np.eye(n), _CONDITION * np.eye(n) - N]
        for A in white:
            AN = A @ N
            blocks.append(np.block([[N, AN.T], [AN, N]]) - margin * np.eye(2 * n))
        return blocks

    (N, _), solver = minimise(
        (Unknown((n, n), symmetric=True), Unknown((1, 1))), lambda N, margin: -margin[0, 0], inequalities, name
    )
    found = rounded_matrix(L @ N @ L.T)
    return CommonLyapunov(found, lyapunov_residuals(closed_loop, found, name), solver)
