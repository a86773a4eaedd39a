"""The data of the nominal problem (paper eq. 31 to eq. 35), and the cost that a gain is certified for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.optimisation.lmi import smallest_eigenvalues
from hsv.model.dynamics import N_RIGID
from hsv.model.trim import trim
from hsv.model.vehicle_parameters import VehicleParameters


@dataclass(frozen=True)
class NominalProblem:
    """The data of (31)-(35).

    ``A`` (r, n, n) and ``B`` (r, n, m) the vertices at sampling ``period``; ``state_scale`` (n) and ``input_scale`` (m)
    the deviations that cost as much as each other: psi = period diag(1 / state_scale^2) and sigma likewise, so that
    costs are in seconds and do not depend on the period; ``input_bound`` (m) the largest |u_n|. All SI.
    """

    A: np.ndarray
    B: np.ndarray
    period: float
    state_scale: np.ndarray
    input_scale: np.ndarray
    input_bound: np.ndarray


def step_deviation(vehicle: VehicleParameters, start: tuple[float, float], target: tuple[float, float]) -> np.ndarray:
    """Return x_n(0) (5) of a step between two flight points (m, m/s): trim at its start less trim at its target, SI."""
    return np.asarray((trim(vehicle, *start).state - trim(vehicle, *target).state)[:N_RIGID])


def certified_cost(problem: NominalProblem, K: np.ndarray, Q: np.ndarray, name: str) -> tuple[float, np.ndarray]:
    """Return the cost (paper eq. 31) that no state of the ellipsoid exceeds under K; residuals (r) of eq. 34 with it.

    The least gamma with gamma (Q^-1 - A_c' Q^-1 A_c) >= psi + K' sigma K at every vertex: (34) for the given matrices.

    Args:
        problem: Vertices and weights.
        K: (m, n) gain, SI.
        Q: (n, n) ellipsoid, SI.
        name: Name of what is verified, for the error message.

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
    """Return by how much the level in the ellipsoid ``outside`` falls under ``K``, the gain of the next one inside.

    The smallest eigenvalue of 1 - M' M at each vertex (r), M = A + B K in the coordinates of ``outside`` (n, n). Where
    all are above zero the level decreases under every gain between the two, at every point of the polytope: it does
    under the gain of ``outside`` by (34), and M' M is convex in M. So x_n never leaves it, and comes to the next one.
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
