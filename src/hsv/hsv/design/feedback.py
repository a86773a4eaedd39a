"""The tube's feedback gain F by linear matrix inequalities over all vertices (paper eq. 22 to eq. 24)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.optimisation import (
    GAIN_DIGITS,
    SolverReport,
    Unknown,
    Whitening,
    lqr_whitening,
    minimise,
    rounded,
    rounded_matrix,
    spectral_radii,
)
from hsv.design.lyapunov import lyapunov_residuals

METHODS = ("guaranteed_cost", "feasibility")

_NAME = "feedback gain F, LMI (24)"

_LITERAL_CONDITION = 1e4
"""Bound on the condition number of N, whitened, in the literal problem: without one it has no bounded answer."""

_STRICT = 1e-6
"""Margin, whitened, that stands for the strict inequality of (24)."""


@dataclass(frozen=True)
class FeedbackGain:
    """F = M N^-1 with its evidence.

    ``F`` (m, n) and ``N`` (n, n) in SI, rounded, ``M`` (m, n) = F N; ``residuals`` (r) the smallest eigenvalue of (24)
    at each vertex, recomputed in coordinates where N is the identity, so that 1 - residual is the contraction of the
    root of e' N^-1 e; ``radii`` (r) the closed-loop spectral radii.
    """

    F: np.ndarray
    M: np.ndarray
    N: np.ndarray
    residuals: np.ndarray
    radii: np.ndarray
    method: str
    solver: SolverReport

    def report(self) -> dict[str, Any]:
        """Return everything a stranger needs to check the gain, for JSON."""
        return {
            "method": self.method,
            "solver": self.solver.as_dict(),
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
    """Return F such that A_i + B_i F share one Lyapunov function (paper eq. 24), verified after solving.

    ``"guaranteed_cost"`` minimises a bound, common to all vertices, of the quadratic cost of the responses to the
    disturbance columns. ``"feasibility"`` is (24) as printed, which leaves F to the solver's taste; it is for study.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m) vertices.
        disturbance: (n, d) columns whose response is to be cheap, SI per period.
        state_scale: (n) deviations that weigh equally in the cost, SI.
        input_scale: (m) inputs that weigh as much, SI.
        method: One of ``METHODS``.

    Raises:
        DesignError: Unknown method, no solution, or a solution that fails (24) when recomputed.
    """
    if method not in METHODS:
        raise DesignError(f"feedback.method = {method!r}: expected one of {', '.join(METHODS)}")
    white = lqr_whitening(A, B, state_scale, input_scale)
    A_white, B_white = white.dynamics(A, B)
    found = (_guaranteed_cost if method == "guaranteed_cost" else _feasibility)(
        A_white, B_white, white, disturbance, state_scale
    )
    (N_white, M_white, *_), solver = found
    F = white.gain(np.linalg.solve(N_white, M_white.T).T)
    F = rounded(F, input_scale[:, None] / state_scale, GAIN_DIGITS)
    N = rounded_matrix(white.covariance(N_white))
    residuals = lyapunov_residuals(A + B @ F, N, _NAME)
    return FeedbackGain(F, F @ N, N, residuals, spectral_radii(A + B @ F), method, solver)


Found = tuple[list[np.ndarray], SolverReport]


def _guaranteed_cost(
    A: np.ndarray, B: np.ndarray, white: Whitening, disturbance: np.ndarray, state_scale: np.ndarray
) -> Found:
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


def _feasibility(A: np.ndarray, B: np.ndarray, *_: object) -> Found:
    n, m = B.shape[1:]

    def inequalities(N: np.ndarray, M: np.ndarray) -> list[np.ndarray]:
        blocks = [N - np.eye(n), _LITERAL_CONDITION * np.eye(n) - N]
        for A_i, B_i in zip(A, B, strict=True):
            S = A_i @ N + B_i @ M
            blocks.append(np.block([[N, S.T], [S, N]]) - _STRICT * np.eye(2 * n))
        return blocks

    return minimise((Unknown((n, n), symmetric=True), Unknown((m, n))), lambda N, M: 0.0, inequalities, _NAME)
