"""Tensor-product model transformation (paper eq. 10 to eq. 12; Baranyi): few vertices, weights for each variable."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from hsv.base.errors import DesignError, one_of
from hsv.model.lpv.polytope import Polytope, axis_weights

FUNCTIONS = ("singular", "polynomial")


Samples = tuple[np.ndarray, np.ndarray]
"""Breakpoints, shape (s,), and weights, shape (s, r), of a scheduling variable; cubic splines join the weights."""


def tensor_product(
    A: np.ndarray,
    B: np.ndarray,
    altitudes: np.ndarray,
    velocities: np.ndarray,
    state_scale: np.ndarray,
    input_scale: np.ndarray,
    tolerance: float,
    functions: str = "singular",
) -> tuple[Polytope, tuple[Samples, Samples], list[np.ndarray]]:
    """Return a polytopic model, with few vertices and a tight hull, of discrete-time samples on a grid (paper eq. 11).

    The second and third result have an entry for altitude and one for velocity: the breakpoints with the weights there;
    and the singular values, relative to the largest, of the matrix whose row i holds all samples at breakpoint i.

    The higher-order singular value decomposition is applied to the scaled [A - I, B]; with A in place of A - I the
    ranks would depend on the sampling period.

    Args:
        A: (n_h, n_v, n, n) discrete-time state matrices, SI.
        B: (n_h, n_v, n, m) input matrices, SI.
        altitudes: Increasing altitudes (m), shape (n_h,).
        velocities: Increasing velocities (m/s), shape (n_v,).
        state_scale: Scales of the states (SI), shape (n,).
        input_scale: Scales of the inputs (SI), shape (m,).
        tolerance: Singular values up to this share of the largest are discarded; the rank r is the number of the rest.
        functions: Basis of the model in each variable: the constant and r - 1 ``"singular"`` functions, which have the
            smallest total error, or ``"polynomial"`` functions up to degree r - 1, which at a low rank distribute the
            error more evenly over small and large entries.

    Raises:
        DesignError: The functions are unknown, there are too few samples for the rank, or no hull was found.
    """
    if functions not in FUNCTIONS:
        raise DesignError(f"tensor_product.functions = {functions!r}: expected {one_of(FUNCTIONS, functions)}")
    n, m = B.shape[2:]
    columns = np.concatenate((state_scale, input_scale))
    samples = np.concatenate((A - np.eye(n), B), axis=3) * columns / state_scale[:, None]

    weights, singular_values = [], []
    for axis, breakpoints in enumerate((altitudes, velocities)):
        unfolded = np.moveaxis(samples, axis, 0).reshape(len(breakpoints), -1)
        values = np.linalg.svd(unfolded, compute_uv=False)
        rank = int(np.count_nonzero(values > tolerance * values[0]))
        if rank >= len(breakpoints):
            raise DesignError(f"{len(breakpoints)} samples of rank {rank}: expected more samples or a larger tolerance")
        # The constant replaces one function of the basis, so that the weights can sum to one exactly.
        if functions == "singular":
            basis = np.linalg.svd(unfolded - unfolded.mean(axis=0), full_matrices=False)[0][:, : rank - 1]
        else:
            middle, half = 0.5 * (breakpoints[0] + breakpoints[-1]), 0.5 * (breakpoints[-1] - breakpoints[0])
            basis = np.vander((breakpoints - middle) / half, rank, increasing=True)[:, 1:]
        weights.append(hull_weights(breakpoints, basis))
        singular_values.append(values / values[0])

    inverse = [np.linalg.pinv(w) for w in weights]
    core = np.einsum("ih,jv,hvab->ijab", *inverse, samples).reshape(-1, n, n + m)
    vertices = core * state_scale[:, None] / columns
    polytope = Polytope(
        vertices[:, :, :n] + np.eye(n),
        np.ascontiguousarray(vertices[:, :, n:]),
        axis_weights(altitudes, weights[0], "cubic"),
        axis_weights(velocities, weights[1], "cubic"),
    )
    return polytope, ((altitudes, weights[0]), (velocities, weights[1])), singular_values


_SUBDIVISION = 16
"""Points per interval of the breakpoints at which the optimisation keeps the weights non-negative."""


def hull_weights(breakpoints: np.ndarray, functions: np.ndarray) -> np.ndarray:
    """Return the weights of the vertices of a small simplex that encloses the curve of ``functions``.

    The cubic splines through the weights are non-negative and sum to one between the breakpoints as well. The result is
    deterministic.

    Args:
        breakpoints: Increasing values of the scheduling variable, shape (s,).
        functions: Values, shape (s, r - 1), of functions that are independent of each other and of the constant.

    Returns:
        Weights at the breakpoints, shape (s, r); vertices are ordered by the breakpoint at which their weight peaks.

    Raises:
        DesignError: The functions and the constant are dependent, or the optimisation ended without a result.
    """
    s, r = len(breakpoints), functions.shape[1] + 1
    if r == 1:
        return np.ones((s, 1))
    # Functions are scaled to unit root mean square.
    centred = functions - functions.mean(axis=0)
    basis = np.hstack((np.ones((s, 1)), centred / np.sqrt(np.mean(centred**2, axis=0))))
    steps = np.arange(_SUBDIVISION) / _SUBDIVISION
    dense = np.append((breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * steps).ravel(), breakpoints[-1])
    weights = basis @ _smallest_simplex(CubicSpline(breakpoints, basis)(dense), _start(basis))
    weights = relaxed(weights, smallest_weight(breakpoints, weights))
    return weights[:, np.argsort(np.argmax(weights, axis=0), kind="stable")]


def smallest_weight(breakpoints: np.ndarray, weights: np.ndarray) -> float:
    """Return the exact minimum of the cubic splines through the columns of ``weights`` (s, r) at ``breakpoints``."""
    least = float(np.min(weights))
    for column in weights.T:
        spline = CubicSpline(breakpoints, column)
        turning = spline.derivative().roots(extrapolate=False)
        turning = turning[np.isfinite(turning)]
        if len(turning):
            least = min(least, float(np.min(spline(turning))))
    return least


def relaxed(weights: np.ndarray, least: float) -> np.ndarray:
    """Return the weights (s, r); if their minimum ``least`` is negative, their simplex is enlarged to make it zero."""
    excess = max(0.0, -least)
    return np.asarray((weights + excess) / (1.0 + weights.shape[1] * excess))


def _start(basis: np.ndarray) -> np.ndarray:
    """Return a first Q (r, r) for :func:`_smallest_simplex`: r rows of ``basis`` as vertices, moved to enclose all."""
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
    """Return Q (r, r) that maximises log |det Q| subject to basis Q >= 0 and Q 1 = e_1.

    The rows of ``basis`` are points of the curve, those of Q^-1 the vertices of the simplex, and ``basis`` Q are the
    weights. The last column of Q follows from the others.
    """
    points, r = basis.shape

    def full(z: np.ndarray) -> np.ndarray:
        free = z.reshape(r, r - 1)
        last = np.eye(r)[:, :1] - free.sum(axis=1, keepdims=True)
        return np.hstack((free, last))

    def volume(z: np.ndarray) -> float:
        return -float(np.linalg.slogdet(full(z))[1])

    def slope(z: np.ndarray) -> np.ndarray:
        gradient = -np.linalg.inv(full(z)).T
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
    return full(solution.x)
