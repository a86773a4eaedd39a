"""Nominal gains by the min-max LMI with input bounds (paper eq. 31 to eq. 35), one gain or a nested family.

K = Y Q^-1 minimises gamma, a bound of the cost sum x_n' psi x_n + u_n' sigma u_n from x_n(0) (eq. 31, 32), subject to

    [1, x_n(0)'; x_n(0), Q] >= 0,                                                                                  (33)
    [Q, (A_i Q + B_i Y)', (psi^1/2 Q)', (sigma^1/2 Y)'; ., Q, 0, 0; ., ., gamma I, 0; ., ., ., gamma I] >= 0,      (34)
    [X, Y; Y', Q] >= 0,   X_jj <= u_nj,max^2                                                                       (35)

with (34) at every vertex i. For the co-designed model, the paper has them as (49) to (52).

The problem is that of Kothare, Balakrishnan and Morari (Automatica 32, 1996), the look-up over nested ellipsoids that
of Wan and Kothare (Automatica 39, 2003). The smallest ellipsoid that contains the state selects the gain. Each
ellipsoid is invariant under its own gain and lies in the one before, so that the state only moves inwards. The second
law of Wan and Kothare interpolates between the gains of two ellipsoids, so that the input is continuous; each ellipsoid
must then also be invariant under the gain of the next one inside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.lmi.semidefinite import (
    GAIN_DIGITS,
    Unknown,
    lqr_whitening,
    minimise,
    rounded_matrix,
    rounded_to_size,
    smallest_eigenvalues,
    spectral_radii,
)
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim


@dataclass(frozen=True)
class NominalProblem:
    """The data of the nominal problem (eq. 31 to eq. 35), SI.

    ``A`` (r, n, n) and ``B`` (r, n, m) are the vertices, discretised with the ``period`` (s). ``state_scale`` (n) and
    ``input_scale`` (m) are deviations that cost the same: psi = period diag(1 / state_scale^2), sigma likewise. As the
    period is a factor of both, costs are integrals over time (s), almost the same for any period. ``input_bound`` (m)
    is the largest permitted |u_n|.
    """

    A: np.ndarray
    B: np.ndarray
    period: float
    state_scale: np.ndarray
    input_scale: np.ndarray
    input_bound: np.ndarray


def step_deviation(vehicle: VehicleParameters, start: tuple[float, float], target: tuple[float, float]) -> np.ndarray:
    """Return x_n(0) (5), SI: trim at ``start`` minus trim at ``target``, each given by altitude (m), velocity (m/s)."""
    return np.asarray((trim(vehicle, *start).state - trim(vehicle, *target).state)[:N_RIGID])


def certified_cost(problem: NominalProblem, K: np.ndarray, Q: np.ndarray, name: str) -> tuple[float, np.ndarray]:
    """Return a bound of the cost (paper eq. 31) from all states of the ellipsoid under K, and residuals (r) of eq. 34.

    The bound is 1 + 1e-9 times the smallest gamma that satisfies eq. 34 with the given matrices at every vertex:
    gamma (Q^-1 - A_c' Q^-1 A_c) >= psi + K' sigma K with A_c = A + B K.

    Args:
        problem: Vertices and weights.
        K: (m, n) gain, SI.
        Q: (n, n) matrix of the ellipsoid x' Q^-1 x <= 1, SI.
        name: Name of the gain, for the error message.

    Raises:
        DesignError: Q is not positive definite, or x' Q^-1 x does not decrease at a vertex.
    """
    try:
        factor = np.linalg.cholesky(Q)
    except np.linalg.LinAlgError as error:
        raise DesignError(f"{name}: Q = {Q.tolist()}, expected a positive definite matrix") from error
    contraction = np.linalg.solve(factor, (problem.A + problem.B @ K) @ factor)
    decrease = np.eye(len(Q)) - np.swapaxes(contraction, 1, 2) @ contraction
    margins = smallest_eigenvalues(decrease)
    worst = int(np.argmin(margins))
    if not margins[worst] > 0.0:
        raise DesignError(f"{name}: decrease at vertex {worst} = {margins[worst]:.3g}, expected above zero")
    weighted = np.vstack((factor / problem.state_scale[:, None], K @ factor / problem.input_scale[:, None]))
    weighted *= np.sqrt(problem.period)
    root = np.linalg.inv(np.linalg.cholesky(0.5 * (decrease + np.swapaxes(decrease, 1, 2))))
    cost = root @ (weighted.T @ weighted) @ np.swapaxes(root, 1, 2)
    # A part in 1e9 more than the least bound, so that its residuals are not negative by rounding.
    gamma = float(np.linalg.eigvalsh(cost).max()) * (1.0 + 1e-9)
    scaled = weighted / np.sqrt(gamma)
    residuals = smallest_eigenvalues(_decrease_blocks(contraction, scaled))
    return gamma, residuals


def decrease_between(problem: NominalProblem, K: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Return the decrease (r) of the level in the ellipsoid ``outside`` (n, n) under ``K``, at each vertex.

    ``K`` (m, n) is the gain of the next ellipsoid inside. The decrease is the smallest eigenvalue of 1 - M' M, with M =
    A + B K in coordinates in which ``outside`` is the unit ball. If it is positive at all vertices, the level decreases
    at every point of the polytope under K, under the gain of ``outside`` (by eq. 34), and under every gain between
    these two (M' M is convex in M). x_n then never leaves ``outside``, and reaches the next ellipsoid.
    """
    factor = np.linalg.cholesky(outside)
    M = np.linalg.solve(factor, (problem.A + problem.B @ K) @ factor)
    return smallest_eigenvalues(np.eye(len(outside)) - np.swapaxes(M, 1, 2) @ M)


def _decrease_blocks(contraction: np.ndarray, weighted: np.ndarray) -> np.ndarray:
    r, n, _ = contraction.shape
    k = n + len(weighted)
    blocks = np.zeros((r, n + k, n + k))
    blocks[:] = np.eye(n + k)
    blocks[:, n : 2 * n, :n] = contraction
    blocks[:, 2 * n :, :n] = weighted
    blocks[:, :n, n : 2 * n] = np.swapaxes(contraction, 1, 2)
    blocks[:, :n, 2 * n :] = weighted.T
    return blocks


@dataclass(frozen=True)
class NominalGain:
    """The gain K = Y Q^-1 of one ellipsoid x' Q^-1 x <= 1, with the numbers that show that eq. 31 to 35 hold.

    ``K`` (m, n) and ``Q`` (n, n) are in SI and rounded, ``Y`` (m, n) is K Q. All other numbers are recomputed from the
    rounded K and Q: ``certified_gamma``, a bound of the cost (s) from any state of the ellipsoid; ``decrease`` (r), the
    smallest eigenvalue of the matrix of eq. 34 at each vertex with this bound, diagonal blocks scaled to 1; ``state``,
    1 minus the level of the design state (eq. 33); ``input`` (m), 1 minus the largest squared input over its squared
    bound (eq. 35); ``nesting``, the smallest eigenvalue of 1 - Q in coordinates in which the next ellipsoid outside is
    the unit ball; ``between`` (r), :func:`decrease_between` in that ellipsoid; ``radii`` (r), the closed-loop spectral
    radii. ``nesting`` is None without an ellipsoid outside, ``between`` also if the family is not interpolated.
    """

    K: np.ndarray
    Y: np.ndarray
    Q: np.ndarray
    certified_gamma: float
    state: float
    decrease: np.ndarray
    input: np.ndarray
    nesting: float | None
    between: np.ndarray | None
    radii: np.ndarray

    def report(self) -> dict[str, Any]:
        """Return the matrices, and residuals with which the gain can be checked, for JSON."""
        between = {} if self.between is None else {"between_smallest_eigenvalues": self.between.tolist()}
        return {
            "Y": self.Y.tolist(),
            "Q": self.Q.tolist(),
            "certified_gamma": self.certified_gamma,
            "state_residual": self.state,
            "lmi_smallest_eigenvalues": self.decrease.tolist(),
            "input_residuals": self.input.tolist(),
            "nesting_residual": self.nesting,
            **between,
            "spectral_radii": self.radii.tolist(),
        }


def nominal_gain(
    problem: NominalProblem,
    state: np.ndarray,
    outside: np.ndarray | None = None,
    *,
    interpolated: bool = False,
    name: str = "nominal gain K, LMI (32)-(35)",
) -> NominalGain:
    """Return the gain with about the smallest worst-case cost from ``state``, verified after solving.

    Paper eq. 32, eq. 33, eq. 34, eq. 35; for the co-designed model eq. 49, eq. 50, eq. 51, eq. 52.

    Args:
        problem: Vertices, weights and input bounds.
        state: (n) design state x_n(0), SI.
        outside: (n, n) Q of an ellipsoid that must contain the new one, or None.
        interpolated: Whether gains between this one and that of ``outside`` must be certified, too.
        name: Name of the result, for error messages.

    Raises:
        DesignError: There is no solution, or the rounded solution violates an inequality.
    """
    white = lqr_whitening(problem.A, problem.B, problem.state_scale, problem.input_scale)
    n, m = problem.B.shape[1:]
    # With the state at unit length and inputs in units of their bounds, all unknowns are near one.
    x = white.to_white @ state
    size = float(np.linalg.norm(x))
    x /= size
    bound = problem.input_bound / (white.input_scale * size)
    A, B = white.dynamics(problem.A, problem.B)
    B = B * bound
    state_root = white.from_white / problem.state_scale[:, None]
    input_root = np.diag(bound)
    limit = None if outside is None else white.to_white @ outside @ white.to_white.T / size**2

    def inequalities(Q: np.ndarray, Y: np.ndarray, gamma: np.ndarray, *slack: np.ndarray) -> list[np.ndarray]:
        # K = Y G^-1; with G = Q these are (33), (34) and (35). X of (35) is set to its bound without loss.
        G = slack[0] if slack else Q
        inner = G + G.T - Q
        blocks = [np.block([[np.ones((1, 1)), x[None, :]], [x[:, None], Q]]), np.block([[np.eye(m), Y], [Y.T, inner]])]
        for A_i, B_i in zip(A, B, strict=True):
            S = A_i @ G + B_i @ Y
            rows = [
                [inner, S.T, (state_root @ G).T, (input_root @ Y).T],
                [S, Q, np.zeros((n, n)), np.zeros((n, m))],
                [state_root @ G, np.zeros((n, n)), gamma * np.eye(n), np.zeros((n, m))],
                [input_root @ Y, np.zeros((m, n)), np.zeros((m, n)), gamma * np.eye(m)],
            ]
            blocks.append(np.block(rows))
            if slack:
                # The level in the ellipsoid outside decreases, too; the size of that ellipsoid is free.
                sized = slack[1] * limit
                blocks.append(np.block([[G + G.T - sized, S.T], [S, sized]]))
        return blocks if limit is None else [*blocks, limit - Q]

    # One matrix G for two Lyapunov functions (de Oliveira, Bernussou, Geromel, Systems & Control Letters 37, 1999).
    slack = [Unknown((n, n)), Unknown((1, 1))] if interpolated and limit is not None else []
    Q, Y, _, *found = minimise(
        (Unknown((n, n), symmetric=True), Unknown((m, n)), Unknown((1, 1)), *slack),
        lambda Q, Y, gamma, *slack: gamma[0, 0],
        inequalities,
        name,
    )
    G = found[0] if found else Q
    # G is not symmetric: K = Y G^-1.
    K = white.gain(np.linalg.solve(G.T, (bound[:, None] * Y).T).T)
    K = rounded_to_size(K, problem.input_scale[:, None] / problem.state_scale, GAIN_DIGITS)
    Q_si = rounded_matrix(white.covariance(Q * size**2))
    certified, decrease = certified_cost(problem, K, Q_si, name)
    if not decrease.min() > -1e-9:
        raise DesignError(f"{name}: smallest eigenvalue of (34) = {decrease.min():.3g}, expected not below zero")
    level = 1.0 - float(state @ np.linalg.solve(Q_si, state))
    if level < 0.0:
        raise DesignError(f"{name}: level of the initial state = {1.0 - level:.9g}, expected at most 1")
    inputs = 1.0 - np.einsum("ij,jk,ik->i", K, Q_si, K) / problem.input_bound**2
    if inputs.min() < 0.0:
        raise DesignError(f"{name}: largest input over its bound = {np.sqrt(1.0 - inputs)}, expected at most 1")
    nesting: float | None = None
    between: np.ndarray | None = None
    if outside is not None:
        factor = np.linalg.inv(np.linalg.cholesky(outside))
        nesting = float(smallest_eigenvalues(np.eye(n) - factor @ Q_si @ factor.T))
        if nesting < 0.0:
            raise DesignError(f"{name}: reaches {-nesting:.3g} outside the ellipsoid before it, expected inside")
        between = decrease_between(problem, K, outside) if interpolated else None
        if between is not None and not between.min() > 0.0:
            raise DesignError(
                f"{name}: decrease of the level in the ellipsoid before it = {between.min():.3g}, expected above zero "
                "for interpolated gains; scales that are closer to each other help"
            )
    radii = spectral_radii(problem.A + problem.B @ K)
    return NominalGain(K, K @ Q_si, Q_si, certified, level, decrease, inputs, nesting, between, radii)


def nested_gains(
    problem: NominalProblem,
    state: np.ndarray,
    scales: Sequence[float],
    *,
    interpolated: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[NominalGain]:
    """Return gains with nested ellipsoids, outermost first; each is designed for ``state`` times one of ``scales``.

    Args:
        problem: Vertices, weights and input bounds.
        state: (n) the largest nominal deviation x_n, SI.
        scales: Decreasing factors, the first usually 1.
        interpolated: Whether gains between those of two ellipsoids must be certified, too.
        progress: Called after each gain with the number solved and the total number.

    Raises:
        DesignError: The scales do not decrease or are not positive, or :func:`nominal_gain` fails.
    """
    if not scales or min(scales) <= 0.0 or any(b >= a for a, b in pairwise(scales)):
        raise DesignError(f"nominal.scales = {list(scales)}: expected decreasing factors above zero")
    gains: list[NominalGain] = []
    for index, scale in enumerate(scales):
        outside = gains[-1].Q if gains else None
        name = f"nominal gain {index + 1} of {len(scales)}, LMI (32)-(35)"
        gains.append(nominal_gain(problem, scale * state, outside, interpolated=interpolated, name=name))
        if progress:
            progress(index + 1, len(scales))
    return gains
