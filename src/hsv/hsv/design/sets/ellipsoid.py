"""The search for the ellipsoid of :mod:`hsv.design.sets.invariant_set` with small half-widths and feedback."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky, solve_discrete_lyapunov, solve_triangular

from hsv.base.errors import DesignError
from hsv.control.optimisation import MATRIX_DIGITS, Unknown, minimise, rounded, rounded_matrix
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.sets.problem import TubeProblem

_INFLATION = 1.002
"""Factor on Q, so that the set is invariant for gains, too, that are tuned in their sixth digit."""


def ellipsoid(
    problem: TubeProblem, state_scale: np.ndarray, input_scale: np.ndarray, contractions: list[float]
) -> InvariantSet:
    """Return the ellipsoid with the least sum of squares of scaled half-widths and feedback (for paper eq. 26).

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
    best: InvariantSet | None = None
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


def _solve(problem: TubeProblem, weight: np.ndarray, contraction: float) -> InvariantSet:
    A0 = problem.system.A.mean(axis=0)
    guess = problem.centre()
    G0 = problem.columns(guess)
    gramian = solve_discrete_lyapunov(A0, np.mean(G0 @ np.swapaxes(G0, 1, 2), axis=0))
    T = cholesky(0.5 * (gramian + gramian.T), lower=True)
    inverse = solve_triangular(T, np.eye(len(T)), lower=True)
    A = inverse @ problem.system.A @ T
    G = inverse @ G0
    r, n, d = G.shape
    weighted = weight.T @ T

    def inequalities(Q: np.ndarray, shift: np.ndarray, multipliers: np.ndarray) -> list[np.ndarray]:
        blocks = [np.diag(1.0 - contraction - multipliers.sum(axis=1))]
        for A_i, G_i, l_i in zip(A, G, multipliers, strict=True):
            drift = G_i[:, -1:] + (A_i - np.eye(n)) @ shift
            columns = np.hstack((G_i[:, :-1], drift))
            AQ = A_i @ Q
            rows = [
                [contraction * Q, np.zeros((n, d)), AQ.T],
                [np.zeros((d, n)), np.diag(l_i), columns.T],
                [AQ, columns, Q],
            ]
            blocks.append(np.block(rows))
        return blocks

    (Q, shift, multipliers), solver = minimise(
        (Unknown((n, n), symmetric=True), Unknown((n, 1)), Unknown((r, d))),
        lambda Q, shift, multipliers: float(np.trace(weighted @ Q @ weighted.T)),
        inequalities,
        f"ellipsoid, contraction {contraction}",
    )
    Q_si = rounded_matrix(_INFLATION * T @ Q @ T.T)
    centre = rounded(guess + T @ shift[:, 0], np.sqrt(np.diag(Q_si)), MATRIX_DIGITS)
    multipliers = rounded(multipliers, 1.0 - contraction, MATRIX_DIGITS)
    return InvariantSet(problem, centre, Q_si, contraction, multipliers, solver)
