"""Finding the recentred ellipsoid of :mod:`hsv.design.sets.ellipsoid_set`, small in half-widths and feedback."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
from cvxpy.atoms.affine.bmat import bmat
from cvxpy.atoms.affine.diag import diag
from cvxpy.atoms.affine.hstack import hstack
from cvxpy.atoms.affine.trace import trace
from scipy.linalg import cholesky, solve_discrete_lyapunov, solve_triangular

from hsv.design.sets.ellipsoid_set import EllipsoidSet, from_shape
from hsv.design.sets.invariant_set import TubeProblem
from hsv.design.solver import solve
from hsv.errors import DesignError

_INFLATION = 1.002
"""Factor on the solver's Q, so that the inequality holds in spite of the solver's accuracy."""

_LEAST_MULTIPLIER = 1e-5
"""Least multiplier of a channel, share of 1 - lam."""


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
