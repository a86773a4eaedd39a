"""Tight convex hulls: sum-normal, non-negative, close-to-normal weights from the functions that span a model."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from hsv.base.errors import DesignError

_SUBDIVISION = 16
"""Points per interval between breakpoints at which the optimisation keeps the weights non-negative."""


def hull_weights(breakpoints: np.ndarray, functions: np.ndarray) -> np.ndarray:
    """Return the weights of the vertices of a small simplex that encloses a curve.

    The curve is (functions, 1); its cubic spline between the breakpoints stays inside too, exactly: weights are
    non-negative and sum to one along the whole spline. Deterministic.

    Args:
        breakpoints: (s) increasing values of the scheduling variable.
        functions: (s, r - 1) functions of it; with the constant they span the model. They must be independent.

    Returns:
        (s, r) weights at the breakpoints, vertices in the order in which their weights peak.

    Raises:
        DesignError: The functions and the constant are dependent, or the optimisation ended without a result.
    """
    s, r = len(breakpoints), functions.shape[1] + 1
    if r == 1:
        return np.ones((s, 1))
    # Unit root mean square: the volume then compares functions, not their sizes.
    centred = functions - functions.mean(axis=0)
    basis = np.hstack((np.ones((s, 1)), centred / np.sqrt(np.mean(centred**2, axis=0))))
    steps = np.arange(_SUBDIVISION) / _SUBDIVISION
    dense = np.append((breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * steps).ravel(), breakpoints[-1])
    weights = basis @ _smallest_simplex(CubicSpline(breakpoints, basis)(dense), _start(basis))
    weights = relaxed(weights, smallest_weight(breakpoints, weights))
    return weights[:, np.argsort(np.argmax(weights, axis=0), kind="stable")]


def smallest_weight(breakpoints: np.ndarray, weights: np.ndarray) -> float:
    """Return the exact minimum of the cubic splines through ``weights`` (s, r) over all breakpoints and columns."""
    least = float(np.min(weights))
    for column in weights.T:
        spline = CubicSpline(breakpoints, column)
        turning = spline.derivative().roots(extrapolate=False)
        turning = turning[np.isfinite(turning)]
        if len(turning):
            least = min(least, float(np.min(spline(turning))))
    return least


def relaxed(weights: np.ndarray, least: float) -> np.ndarray:
    """Return ``weights`` (s, r) of the simplex enlarged about its centre until a weight of ``least`` becomes zero."""
    excess = max(0.0, -least)
    return np.asarray((weights + excess) / (1.0 + weights.shape[1] * excess))


def _start(basis: np.ndarray) -> np.ndarray:
    """Return Q (r, r) of the simplex through r points of the curve, enlarged until it holds the whole curve."""
    s, r = basis.shape
    chosen = np.round(0.5 * (1.0 - np.cos(np.pi * np.arange(r) / (r - 1))) * (s - 1)).astype(int)
    if np.linalg.matrix_rank(basis[chosen]) < r:
        raise DesignError(
            f"weights of {r} vertices: the functions and the constant are dependent, expected {r} that are not"
        )
    Q = np.linalg.inv(basis[chosen])
    excess = max(0.0, -float(np.min(basis @ Q)))
    return np.asarray((Q + excess * Q.sum(axis=1, keepdims=True)) / (1.0 + r * excess))


def _smallest_simplex(basis: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return Q (r, r) that maximises log |det Q| with basis Q >= 0 and Q 1 = e_1, which makes weights sum to one.

    The vertices are the rows of Q^-1, so that a large determinant is a small simplex. The last column of Q follows
    from the others.
    """
    points, r = basis.shape

    def whole(z: np.ndarray) -> np.ndarray:
        free = z.reshape(r, r - 1)
        last = np.eye(r)[:, :1] - free.sum(axis=1, keepdims=True)
        return np.hstack((free, last))

    def volume(z: np.ndarray) -> float:
        return -float(np.linalg.slogdet(whole(z))[1])

    def slope(z: np.ndarray) -> np.ndarray:
        gradient = -np.linalg.inv(whole(z)).T
        return (gradient[:, :-1] - gradient[:, -1:]).ravel()

    jacobian = np.zeros((r, points, r, r - 1))
    for j in range(r - 1):
        jacobian[j, :, :, j] = basis
        jacobian[r - 1, :, :, j] = -basis
    linear = jacobian.reshape(r * points, r * (r - 1))
    constant = np.zeros(r * points)
    constant[-points:] = basis[:, 0]
    solution = minimize(
        volume,
        start[:, :-1].ravel(),
        jac=slope,
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda z: linear @ z + constant, "jac": lambda z: linear},
        options={"maxiter": 500, "ftol": 1e-10},
    )
    if not solution.success:
        raise DesignError(f"weights of {r} vertices: {solution.message}, expected a smallest simplex")
    return whole(solution.x)
