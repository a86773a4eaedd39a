"""The tube's feedback gain F by linear matrix inequalities over all vertices (paper eq. 22 to eq. 24).

Without disturbances, the error (22) is e(k+1) = (A_i + B_i F) e(k). With F = M N^-1, the function e' N^-1 e decreases
at every vertex i if

    [N, (A_i N + B_i M)'; A_i N + B_i M, N] > 0.                                                                   (24)

This alone does not determine F. The design minimises a bound, common to all vertices, of the quadratic cost of the
responses to typical disturbances, the columns of D. The bound is the trace of Z, subject to

    [Z, D'; D, N] >= 0,   [N, (A_i N + B_i M)', (R N)', M'; ., N, 0, 0; ., ., I, 0; ., ., ., I] >= 0.

R divides the states by their scales; the inputs are in units of theirs. Dots: the transposes of the mirrored blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_discrete_lyapunov

from hsv.base.errors import DesignError, one_of
from hsv.lmi.semidefinite import (
    GAIN_DIGITS,
    Unknown,
    Whitening,
    ellipsoid_norms,
    lqr_whitening,
    minimise,
    rounded_matrix,
    rounded_to_size,
    spectral_radii,
)

_NAME = "feedback gain F, LMI (24)"

_LITERAL_CONDITION = 1e4
"""Bound on the condition number of N in whitened coordinates, if (24) is solved as printed: it alone leaves N free."""

_STRICT = 1e-6
"""Margin, in whitened coordinates, that replaces the strict inequality of (24)."""


_CONDITION = 1e3
"""Bound on the condition number of N in whitened coordinates; without it :func:`common_lyapunov` has no maximum."""


def lyapunov_residuals(closed_loop: np.ndarray, N: np.ndarray, name: str) -> np.ndarray:
    """Return the smallest eigenvalue (r) of [N, (A_c N)'; A_c N, N] for each closed loop A_c, with N scaled to I.

    Args:
        closed_loop: (r, n, n) A_i + B_i F.
        N: (n, n) matrix of (24).
        name: Name of the verified result, for the error message.

    Raises:
        DesignError: N is not positive definite, or an eigenvalue is not positive.
    """
    residuals = 1.0 - ellipsoid_norms(N, f"{name}: N", closed_loop)
    worst = int(np.argmin(residuals))
    if not residuals[worst] > 0.0:
        raise DesignError(
            f"{name}: smallest eigenvalue at vertex {worst} = {residuals[worst]:.3g}, expected above zero"
        )
    return residuals


@dataclass(frozen=True)
class FeedbackGain:
    """The feedback gain F = M N^-1 with its evidence.

    ``F`` (m, n) and ``N`` (n, n) in SI, rounded; ``M`` (m, n) = F N. ``residuals`` (r): smallest eigenvalue of the
    matrix in eq. 24 at each vertex, recomputed with N scaled to the identity. After a step at a vertex, without
    disturbance, sqrt(e' N^-1 e) is at most (1 - residual) times its value before. ``radii`` (r): spectral radii.
    """

    F: np.ndarray
    M: np.ndarray
    N: np.ndarray
    residuals: np.ndarray
    radii: np.ndarray

    def report(self) -> dict[str, Any]:
        """Return the numbers with which the gain can be checked independently, for JSON."""
        return {
            "M": self.M.tolist(),
            "N": self.N.tolist(),
            "lmi_smallest_eigenvalues": self.residuals.tolist(),
            "spectral_radii": self.radii.tolist(),
        }


def feedback_gain(
    A: np.ndarray,
    B: np.ndarray,
    disturbance: np.ndarray,
    state_scale: np.ndarray,
    input_scale: np.ndarray,
    method: str = "guaranteed_cost",
) -> FeedbackGain:
    """Return F such that all A_i + B_i F share one Lyapunov function (paper eq. 24), verified after solving.

    ``"guaranteed_cost"`` minimises a bound, common to all vertices, of the quadratic cost of the responses to the
    disturbance columns. ``"feasibility"`` is eq. 24 as printed, which does not determine F; it is for studies only.

    Args:
        A: (r, n, n) state matrices of the vertices.
        B: (r, n, m) input matrices of the vertices.
        disturbance: (n, d) disturbance columns whose responses are penalised, SI per period.
        state_scale: (n) deviations of the states that cost equally, SI.
        input_scale: (m) inputs that cost as much as these deviations, SI.
        method: ``"guaranteed_cost"`` or ``"feasibility"``.

    Raises:
        DesignError: Unknown method, no solution, or a solution that fails (24) when recomputed.
    """
    if method not in _SEARCHES:
        raise DesignError(f"feedback.method = {method!r}: expected {one_of(_SEARCHES, method)}")
    white = lqr_whitening(A, B, state_scale, input_scale)
    N_white, M_white, *_ = _SEARCHES[method](*white.dynamics(A, B), white, disturbance, state_scale)
    F = white.gain(np.linalg.solve(N_white, M_white.T).T)
    F = rounded_to_size(F, input_scale[:, None] / state_scale, GAIN_DIGITS)
    N = rounded_matrix(white.covariance(N_white))
    residuals = lyapunov_residuals(A + B @ F, N, _NAME)
    return FeedbackGain(F, F @ N, N, residuals, spectral_radii(A + B @ F))


def _guaranteed_cost(
    A: np.ndarray, B: np.ndarray, white: Whitening, disturbance: np.ndarray, state_scale: np.ndarray
) -> list[np.ndarray]:
    n, m = B.shape[1:]
    columns = white.to_white @ disturbance
    columns = columns / np.linalg.norm(columns, 2)
    d = columns.shape[1]
    root = white.from_white / state_scale[:, None]

    def inequalities(N: np.ndarray, M: np.ndarray, Z: np.ndarray) -> list[np.ndarray]:
        blocks = [np.block([[Z, columns.T], [columns, N]])]
        for A_i, B_i in zip(A, B, strict=True):
            S = A_i @ N + B_i @ M
            rows = [
                [N, S.T, (root @ N).T, M.T],
                [S, N, np.zeros((n, n)), np.zeros((n, m))],
                [root @ N, np.zeros((n, n)), np.eye(n), np.zeros((n, m))],
                [M, np.zeros((m, n)), np.zeros((m, n)), np.eye(m)],
            ]
            blocks.append(np.block(rows))
        return blocks

    unknowns = Unknown((n, n), symmetric=True), Unknown((m, n)), Unknown((d, d), symmetric=True)
    return minimise(unknowns, lambda N, M, Z: float(np.trace(Z)), inequalities, _NAME)


def _feasibility(A: np.ndarray, B: np.ndarray, *_: object) -> list[np.ndarray]:
    n, m = B.shape[1:]

    def inequalities(N: np.ndarray, M: np.ndarray) -> list[np.ndarray]:
        blocks = [N - np.eye(n), _LITERAL_CONDITION * np.eye(n) - N]
        for A_i, B_i in zip(A, B, strict=True):
            S = A_i @ N + B_i @ M
            blocks.append(np.block([[N, S.T], [S, N]]) - _STRICT * np.eye(2 * n))
        return blocks

    return minimise((Unknown((n, n), symmetric=True), Unknown((m, n))), lambda N, M: 0.0, inequalities, _NAME)


_SEARCHES: dict[str, Callable[..., list[np.ndarray]]] = {
    "guaranteed_cost": _guaranteed_cost,
    "feasibility": _feasibility,
}


@dataclass(frozen=True)
class CommonLyapunov:
    """A Lyapunov function e' N^-1 e of r loops: ``N`` (n, n), SI; ``residuals`` (r) from :func:`lyapunov_residuals`."""

    N: np.ndarray
    residuals: np.ndarray

    def report(self) -> dict[str, Any]:
        """Return the matrix and its evidence, for JSON."""
        return {
            "N": self.N.tolist(),
            "lmi_smallest_eigenvalues": self.residuals.tolist(),
        }


def common_lyapunov(closed_loop: np.ndarray, scale: np.ndarray, name: str) -> CommonLyapunov:
    """Return a Lyapunov function e' N^-1 e common to all closed loops, with the largest margin in paper eq. 24.

    The margin is recomputed after solving.

    Args:
        closed_loop: (r, n, n) discrete-time state matrices.
        scale: (n) deviations of the states that weigh equally, SI.
        name: Name of the certified result, for the error message.

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

    N, _ = minimise(
        (Unknown((n, n), symmetric=True), Unknown((1, 1))), lambda N, margin: -margin[0, 0], inequalities, name
    )
    found = rounded_matrix(L @ N @ L.T)
    return CommonLyapunov(found, lyapunov_residuals(closed_loop, found, name))
