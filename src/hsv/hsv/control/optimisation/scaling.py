"""Coordinates in which the linear matrix inequalities are well conditioned.

Unscaled, or scaled by typical sizes only, the inequalities of a fast-sampled integrator chain defeat interior-point
solvers. In coordinates whitened by a central LQR problem the sought Lyapunov matrices are near multiples of the
identity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_discrete_are, solve_triangular

from hsv.base.errors import DesignError


@dataclass(frozen=True)
class Whitening:
    """New coordinates: state z = ``to_white`` x, input v = u / ``input_scale``.

    ``to_white`` and its inverse ``from_white`` (n, n); ``input_scale`` (m).
    """

    to_white: np.ndarray
    from_white: np.ndarray
    input_scale: np.ndarray

    def dynamics(self, A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return A (..., n, n) and B (..., n, m) in the new coordinates."""
        return self.to_white @ A @ self.from_white, self.to_white @ B * self.input_scale

    def gain(self, K: np.ndarray) -> np.ndarray:
        """Return a gain (m, n), found in the new coordinates, in the original ones."""
        return np.asarray(self.input_scale[:, None] * (K @ self.to_white))

    def covariance(self, N: np.ndarray) -> np.ndarray:
        """Return a matrix N (n, n) of the kind x' N^-1 x <= 1, found in the new coordinates, in the original ones."""
        return _symmetric(self.from_white @ N @ self.from_white.T)

    def cross(self, M: np.ndarray) -> np.ndarray:
        """Return M = gain times covariance (m, n), found in the new coordinates, in the original ones."""
        return np.asarray(self.input_scale[:, None] * (M @ self.from_white.T))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (matrix + matrix.T))


def lqr_whitening(A: np.ndarray, B: np.ndarray, state_scale: np.ndarray, input_scale: np.ndarray) -> Whitening:
    """Return the whitening by the Cholesky factor of the Riccati solution at the mean of the vertices.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m) vertices.
        state_scale: (n) deviations that weigh equally in the LQR cost, SI.
        input_scale: (m) inputs that weigh as much, SI.

    Raises:
        DesignError: The mean of the vertices cannot be stabilised.
    """
    weight = np.diag(1.0 / state_scale**2)
    try:
        riccati = solve_discrete_are(A.mean(axis=0), B.mean(axis=0), weight, np.diag(1.0 / input_scale**2))
        factor = cholesky(_symmetric(riccati))
    except (LinAlgError, ValueError) as error:
        raise DesignError(
            f"mean of the vertices: no stabilising LQR solution ({error}), check scales and model"
        ) from error
    inverse = solve_triangular(factor, np.eye(len(factor)))
    return Whitening(factor, inverse, np.asarray(input_scale, float))
