"""The tube's feedback gain F by linear matrix inequalities over all vertices (paper eq. 22-24)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
from cvxpy.atoms.affine.bmat import bmat
from cvxpy.atoms.affine.trace import trace

from hsv.design.lmi import SolverReport, spectral_radii
from hsv.design.lyapunov import lyapunov_residuals
from hsv.design.scaling import Whitening, lqr_whitening
from hsv.design.solver import solve
from hsv.errors import DesignError

METHODS = ("guaranteed_cost", "feasibility")

_LITERAL_CONDITION = 1e4
"""Bound on the condition number of N, whitened, in the literal problem: without one it has no bounded answer."""

_STRICT = 1e-6
"""Margin, whitened, that stands for the strict inequality of (24)."""


@dataclass(frozen=True)
class FeedbackGain:
    """F = M N^-1 with its evidence.

    ``F`` (m, n), ``M`` (m, n), ``N`` (n, n) in SI; ``residuals`` (r) the smallest eigenvalue of (24) at each vertex,
    recomputed in coordinates where N is the identity, so that 1 - residual is the contraction of e' N^-1 e's root;
    ``radii`` (r) the closed-loop spectral radii.
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
    """Return F such that A_i + B_i F share one Lyapunov function, verified after solving.

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
    n, m = B.shape[1:]
    N = cp.Variable((n, n), symmetric=True)
    M = cp.Variable((m, n))
    if method == "guaranteed_cost":
        problem = _guaranteed_cost(N, M, A_white, B_white, white, disturbance, state_scale)
    else:
        problem = _feasibility(N, M, A_white, B_white)
    solver = solve(problem, "feedback gain F, LMI (24)")
    N_white, M_white = np.asarray(N.value), np.asarray(M.value)
    N_si, M_si = white.covariance(N_white), white.cross(M_white)
    F = white.gain(np.linalg.solve(N_white, M_white.T).T)
    residuals = lyapunov_residuals(A + B @ F, N_si, "feedback gain F, LMI (24)")
    return FeedbackGain(F, M_si, N_si, residuals, spectral_radii(A + B @ F), method, solver)


def _guaranteed_cost(
    N: cp.Variable,
    M: cp.Variable,
    A: np.ndarray,
    B: np.ndarray,
    white: Whitening,
    disturbance: np.ndarray,
    state_scale: np.ndarray,
) -> cp.Problem:
    n, m = B.shape[1:]
    columns = white.to_white @ disturbance
    columns = columns / np.linalg.norm(columns, 2)
    d = columns.shape[1]
    root = white.from_white / state_scale[:, None]
    Z = cp.Variable((d, d), symmetric=True)
    constraints = [bmat([[Z, columns.T], [columns, N]]) >> 0]
    for A_i, B_i in zip(A, B, strict=True):
        S = A_i @ N + B_i @ M
        blocks = [
            [N, S.T, (root @ N).T, M.T],
            [S, N, np.zeros((n, n)), np.zeros((n, m))],
            [root @ N, np.zeros((n, n)), np.eye(n), np.zeros((n, m))],
            [M, np.zeros((m, n)), np.zeros((m, n)), np.eye(m)],
        ]
        constraints.append(bmat(blocks) >> 0)
    return cp.Problem(cp.Minimize(trace(Z)), constraints)


def _feasibility(N: cp.Variable, M: cp.Variable, A: np.ndarray, B: np.ndarray) -> cp.Problem:
    n = A.shape[1]
    constraints = [N >> np.eye(n), N << _LITERAL_CONDITION * np.eye(n)]
    for A_i, B_i in zip(A, B, strict=True):
        S = A_i @ N + B_i @ M
        constraints.append(bmat([[N, S.T], [S, N]]) >> _STRICT * np.eye(2 * n))
    return cp.Problem(cp.Minimize(0), constraints)
