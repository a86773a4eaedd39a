"""The recentred ellipsoid {c + v: v' Q^-1 v <= 1} by the S-procedure over all vertices: the certified default.

At vertex i, v+ = A_i v + G_i d with |d_j| <= 1 (and one more constant d, the drift of the centre) stays inside if there
are lam and l_j >= 0, sum l_j <= 1 - lam, with

    [lam Q, 0, Q A_i'; 0, diag(l), G_i'; A_i Q, G_i, Q] >= 0.

Convex combinations of vertices follow, because the set is convex. For fixed lam this is linear in Q, l and c.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
from cvxpy.atoms.affine.bmat import bmat
from cvxpy.atoms.affine.diag import diag
from cvxpy.atoms.affine.hstack import hstack
from cvxpy.atoms.affine.trace import trace
from scipy.linalg import LinAlgError, cholesky, solve_discrete_lyapunov, solve_triangular

from hsv.design.lmi import SolverReport, smallest_eigenvalues, solve
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem
from hsv.errors import DesignError

_INFLATION = 1.002
"""Factor on the solver's Q, so that the inequality holds in spite of the solver's accuracy."""

_LEAST_MULTIPLIER = 1e-5
"""Least multiplier of a channel, share of 1 - lam."""


@dataclass(frozen=True)
class EllipsoidSet(InvariantSet):
    """The set with what certifies it: ``Q`` (n, n), ``contraction`` lam, ``multipliers`` l (r, d + 1)."""

    Q: np.ndarray
    contraction: float
    multipliers: np.ndarray
    solver: SolverReport

    kind = "ellipsoid"

    @property
    def shape(self) -> np.ndarray:
        """P = Q^-1 (n, n)."""
        P = np.linalg.inv(self.Q)
        return np.asarray(0.5 * (P + P.T))

    def level(self, error: np.ndarray) -> np.ndarray:
        """Return (e - c)' P (e - c) of errors (..., n)."""
        v = error - self.centre
        return np.asarray(np.einsum("...i,ij,...j->...", v, self.shape, v))

    def certify(self) -> dict[str, Any]:
        """Recompute the inequality at every vertex, in coordinates where Q is the identity."""
        residuals = vertex_residuals(self.problem, self.centre, self.Q, self.contraction, self.multipliers)
        origin = float(self.level(np.zeros(len(self.Q))))
        worst = int(np.argmin(residuals))
        if not residuals[worst] > 0.0:
            raise DesignError(f"ellipsoid: inequality at vertex {worst} = {residuals[worst]:.3g}, expected above zero")
        if not origin <= 1.0:
            raise DesignError(f"ellipsoid: level of e = 0 is {origin:.6g}, expected at most 1: flights start there")
        return {"lmi_smallest_eigenvalues": residuals.tolist(), "level_of_zero_error": origin}


def ellipsoid(
    problem: TubeProblem, state_scale: np.ndarray, input_scale: np.ndarray, contractions: list[float]
) -> EllipsoidSet:
    """Return the ellipsoid whose half-widths and feedback, scaled, have the least sum of squares.

    Args:
        problem: Error system and disturbances.
        state_scale: (5) half-widths of the rigid states that count as equal.
        input_scale: (2) half-ranges of the feedback that count as much.
        contractions: Values of lam to try.

    Raises:
        DesignError: No solution for any lam, or one that fails when recomputed.
    """
    weight = np.zeros((len(problem.system.A[0]), len(state_scale) + len(input_scale)))
    weight[: len(state_scale), : len(state_scale)] = np.diag(1.0 / state_scale)
    weight[:, len(state_scale) :] = (problem.system.F / input_scale[:, None]).T
    best: EllipsoidSet | None = None
    failure: DesignError | None = None
    for contraction in contractions:
        try:
            found = _solve(problem, weight, contraction)
            found.certify()
        except DesignError as error:
            failure = error
            continue
        if best is None or np.sum((weight.T @ found.Q) * weight.T) < np.sum((weight.T @ best.Q) * weight.T):
            best = found
    if best is None:
        raise DesignError(f"ellipsoid: none for any contraction of {contractions}: {failure}")
    return best


def from_shape(
    problem: TubeProblem,
    centre: np.ndarray,
    Q: np.ndarray,
    contraction: float,
    multipliers: np.ndarray,
    solver: SolverReport,
) -> EllipsoidSet:
    """Return the set with its outer box and feedback range computed from ``Q``."""
    F = problem.system.F
    feedback = np.sqrt(np.einsum("ij,jk,ik->i", F, Q, F))
    return EllipsoidSet(problem, centre, np.sqrt(np.diag(Q)), feedback, Q, contraction, multipliers, solver)


def vertex_residuals(
    problem: TubeProblem, centre: np.ndarray, Q: np.ndarray, contraction: float, multipliers: np.ndarray
) -> np.ndarray:
    """Return the smallest eigenvalue (r) of the inequality at each vertex; above zero: invariant.

    By its Schur complement, with Q and the diagonal scaled to the identity.

    Raises:
        DesignError: Q is not positive definite, or multipliers that are negative or sum to more than 1 - lam.
    """
    try:
        factor = cholesky(Q, lower=True)
    except LinAlgError as error:
        raise DesignError("ellipsoid: Q is not positive definite") from error
    if multipliers.min() < 0.0 or multipliers.sum(axis=1).max() > (1.0 - contraction) * (1.0 + 1e-12):
        raise DesignError("ellipsoid: multipliers: expected none negative and sums of at most 1 - contraction")
    A = np.linalg.solve(factor, problem.system.A @ factor)
    G = np.linalg.solve(factor, problem.columns(centre))
    r, n, d = G.shape
    # Multiplying out the last block row: M = diag(lam, l) - [A, G]' [A, G], scaled to a unit diagonal.
    AG = np.concatenate((A, G), axis=2)
    scale = np.concatenate((np.full((r, n), contraction), multipliers), axis=1)
    if scale.min() <= 0.0:
        raise DesignError("ellipsoid: multipliers: expected all above zero")
    root = 1.0 / np.sqrt(scale)
    M = np.eye(n + d) - root[:, :, None] * (np.swapaxes(AG, 1, 2) @ AG) * root[:, None, :]
    return smallest_eigenvalues(M)


def _solve(problem: TubeProblem, weight: np.ndarray, contraction: float) -> EllipsoidSet:
    A0 = problem.system.A.mean(axis=0)
    guess = problem.centre()
    G0 = problem.columns(guess)
    gramian = solve_discrete_lyapunov(A0, np.mean(G0 @ np.swapaxes(G0, 1, 2), axis=0))
    T = cholesky(0.5 * (gramian + gramian.T), lower=True)
    inverse = solve_triangular(T, np.eye(len(T)), lower=True)
    A = inverse @ problem.system.A @ T
    G = inverse @ G0
    r, n, d = G.shape
    Q = cp.Variable((n, n), symmetric=True)
    shift = cp.Variable(n)
    multipliers = cp.Variable((r, d), nonneg=True)
    weighted = weight.T @ T
    constraints = [cp.sum(multipliers, axis=1) <= 1.0 - contraction]
    for i in range(r):
        drift = G[i, :, -1] + (A[i] - np.eye(n)) @ shift
        columns = hstack([G[i, :, :-1], cp.reshape(drift, (n, 1), order="C")])
        AQ = A[i] @ Q
        constraints.append(
            bmat(
                [
                    [contraction * Q, np.zeros((n, d)), AQ.T],
                    [np.zeros((d, n)), diag(multipliers[i]), columns.T],
                    [AQ, columns, Q],
                ]
            )
            >> 0
        )
    objective = cp.Minimize(trace(weighted @ Q @ weighted.T))
    solver = solve(cp.Problem(objective, constraints), f"ellipsoid, contraction {contraction}")
    Q_si = T @ np.asarray(Q.value) @ T.T
    Q_si = _INFLATION * 0.5 * (Q_si + Q_si.T)
    centre = guess + T @ np.asarray(shift.value)
    # A share for every channel: the smallest disturbances are at the level of the solver's accuracy.
    values = np.maximum(np.asarray(multipliers.value), 0.0) + _LEAST_MULTIPLIER * (1.0 - contraction)
    values *= (1.0 - contraction) / values.sum(axis=1, keepdims=True)
    return from_shape(problem, centre, Q_si, contraction, values, solver)
