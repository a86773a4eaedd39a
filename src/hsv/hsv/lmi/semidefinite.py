"""Linear matrix inequalities posed so that they have a unique solution, which every processor finds.

The optimum of a semidefinite programme need not be unique, and rounding decides the last steps of a solver near it:
nominal gains that differ by 50 % have the same cost to 1e-4. The solution returned is therefore not the optimum
but a point of the central path, the minimum of

    t c'x - sum_k log det G_k(x)

over the unknowns x, with cost c'x and inequalities G_k(x) >= 0. The factor t is chosen so that the cost is about
:data:`GAP` (relative) above the optimum. This function is smooth and strictly convex. Of all points of the same cost,
its minimum has the largest product of the eigenvalues of all G_k(x), and so keeps clear of the bounds. Newton's method
finds it to rounding from any interior point; Clarabel provides one. A problem without cost is left to Clarabel alone.

Unscaled, or scaled by typical sizes only, the inequalities of a fast-sampled integrator chain defeat interior-point
solvers. In coordinates whitened by an LQR problem at the mean vertex (:class:`Whitening`), the Lyapunov matrices are
close to multiples of the identity. The results of each stage of a design are rounded to their significant digits.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_discrete_are, solve_triangular

from hsv.base.errors import DesignError


def smallest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the smallest eigenvalue (r) of the symmetric part of each matrix (r, k, k)."""
    return np.linalg.eigvalsh(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))[..., 0]


def spectral_radii(matrices: np.ndarray) -> np.ndarray:
    """Return the spectral radius (r) of each matrix (r, n, n)."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))


def ellipsoid_norms(Q: np.ndarray, name: str, M: np.ndarray, *columns: np.ndarray) -> np.ndarray:
    """Return, for each M, the largest singular value of L^-1 [M L, columns] with Q = L L'; shape (...).

    If it is at most 1, M maps the ellipsoid x' Q^-1 x <= 1 into itself. Without further columns, the smallest
    eigenvalue of [Q, (M Q)'; M Q, Q], with its diagonal blocks scaled to the identity, is 1 minus this value.

    Args:
        Q: (n, n) matrix of the ellipsoid.
        name: Name of the ellipsoid, for the error message.
        M: (..., n, n) matrices.
        columns: (..., n, d) further columns.

    Raises:
        DesignError: Q is not positive definite.
    """
    try:
        L = np.linalg.cholesky(Q)
    except np.linalg.LinAlgError as error:
        raise DesignError(f"{name} is not positive definite") from error
    return np.asarray(np.linalg.norm(np.linalg.solve(L, np.concatenate((M @ L, *columns), axis=-1)), 2, axis=(-2, -1)))


def inverse(Q: np.ndarray) -> np.ndarray:
    """Return Q^-1 (n, n), made exactly symmetric."""
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


VERTEX_DIGITS = 12
"""Digits to which vertices are rounded, relative to the scales of the model. Two processors agree on ten, but the slow
modes in the Bode plot need twelve. Entries that are zero in the physical model are below 1e-14 and become zero."""

GAIN_DIGITS = 6
"""Digits to which gains are rounded, relative to the scales of their problem; processors agree on eight."""

MATRIX_DIGITS = 11
"""Digits to which ellipsoids, their centres and multipliers are rounded, relative to their own sizes. Processors agree
on eight, but an ellipsoid must also be invariant and nested in its thinnest direction, where its entries cancel."""

BOUND_DIGITS = 6
"""Significant digits to which the bounds of disturbances and inputs are rounded."""


def rounded_to_size(values: np.ndarray, size: Any, digits: int) -> np.ndarray:
    """Return ``values`` rounded to ``digits`` digits after the leading digit of ``size``, their typical magnitude."""
    values = np.asarray(values, float)
    leading = np.floor(np.log10(np.broadcast_to(np.asarray(size, float), values.shape))).astype(int)
    flat = [round(v, digits - k) for v, k in zip(values.ravel().tolist(), leading.ravel().tolist(), strict=True)]
    # Without negative zeros.
    return np.array(flat).reshape(values.shape) + 0.0


def rounded_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return the positive definite M = ``matrix`` (n, n) made symmetric, M_ij rounded relative to root(M_ii M_jj)."""
    root = np.sqrt(np.diag(matrix))
    return rounded_to_size(0.5 * (matrix + matrix.T), np.outer(root, root), MATRIX_DIGITS)


def outward(values: np.ndarray) -> np.ndarray:
    """Return ``values`` rounded away from zero to :data:`BOUND_DIGITS` significant digits.

    A value that is farther from zero than such a rounded number by at most 1e-12, relative, becomes that number.
    """
    values = np.asarray(values, float)
    size = np.where(values == 0.0, 1.0, np.abs(values))
    quantum = 10.0 ** (np.floor(np.log10(size)) - BOUND_DIGITS + 1)
    # The margin keeps a multiple of the quantum, of which the division made slightly more.
    multiples = np.ceil(np.abs(values) / quantum * (1.0 - 1e-12))
    return rounded_to_size(np.sign(values) * multiples * quantum, size, BOUND_DIGITS)


@dataclass(frozen=True)
class Whitening:
    """New coordinates of a linear system: state z = ``to_white`` x, input v = u / ``input_scale``.

    ``from_white`` (n, n) is the inverse of ``to_white`` (n, n); ``input_scale`` has shape (m).
    """

    to_white: np.ndarray
    from_white: np.ndarray
    input_scale: np.ndarray

    def dynamics(self, A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrices ``A`` (..., n, n) and ``B`` (..., n, m), transformed to the new coordinates."""
        return self.to_white @ A @ self.from_white, self.to_white @ B * self.input_scale

    def gain(self, K: np.ndarray) -> np.ndarray:
        """Return a gain ``K`` (m, n) of the new coordinates, transformed to the original ones."""
        return np.asarray(self.input_scale[:, None] * (K @ self.to_white))

    def covariance(self, N: np.ndarray) -> np.ndarray:
        """Return ``N`` (n, n), an ellipsoid z' N^-1 z <= 1 of the new coordinates, transformed to the original ones."""
        return _symmetric(self.from_white @ N @ self.from_white.T)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (matrix + matrix.T))


def lqr_whitening(A: np.ndarray, B: np.ndarray, state_scale: np.ndarray, input_scale: np.ndarray) -> Whitening:
    """Return the coordinates in which the solution of the Riccati equation at the mean of the vertices is the identity.

    Args:
        A: (r, n, n) state matrices of the vertices, discrete time.
        B: (r, n, m) input matrices of the vertices.
        state_scale: (n) deviations that weigh equally in the LQR cost, SI.
        input_scale: (m) inputs that weigh as much as these deviations, SI.

    Raises:
        DesignError: The mean of the vertices cannot be stabilised.
    """
    weight = np.diag(1.0 / state_scale**2)
    try:
        riccati = solve_discrete_are(A.mean(axis=0), B.mean(axis=0), weight, np.diag(1.0 / input_scale**2))
        factor = cholesky(_symmetric(riccati))
    except (LinAlgError, ValueError) as error:
        raise DesignError(
            f"mean of the vertices: no stabilising LQR solution ({error}), check scales and model"
        ) from error
    inverse = solve_triangular(factor, np.eye(len(factor)))
    return Whitening(factor, inverse, np.asarray(input_scale, float))


GAP = 1e-3
"""Intended relative gap between the cost of a solution and the minimum; within a factor of the root of 2."""

_INSIDE = (1e-5, 1e-4, 1e-3, 1e-8)
"""Lower bounds of the inequalities' eigenvalues in the search for an interior start, tried in order.

A solution that the solver calls inaccurate may be off by 1e-5; inequalities with little room need a smaller bound.
"""

_STEPS = 500
"""Maximum number of Newton steps; about twenty to eighty are needed."""

_CONVERGED = 1e-7
"""Newton decrement below which one more step reaches the minimum to rounding."""

_NEAR = 1e-4
"""Newton decrement below which rounding alone can keep the decrement from falling; the iteration then ends, too."""


@dataclass(frozen=True)
class Unknown:
    """An unknown matrix of an optimisation problem, of the given ``shape`` (m, n), or symmetric (n, n)."""

    shape: tuple[int, int]
    symmetric: bool = False

    @property
    def size(self) -> int:
        """Number of free entries of the matrix."""
        m, n = self.shape
        return n * (n + 1) // 2 if self.symmetric else m * n

    def matrix(self, x: np.ndarray) -> np.ndarray:
        """Return the matrix with the free entries ``x``: row by row, only in the upper triangle if it is symmetric."""
        if not self.symmetric:
            return x.reshape(self.shape)
        value = np.zeros(self.shape)
        value[np.triu_indices(len(value))] = x
        return np.asarray(value + np.triu(value, 1).T)


Inequalities = Callable[..., Sequence[np.ndarray]]
"""Function of the unknown matrices that returns symmetric matrices, affine in them, to be positive semidefinite."""

Cost = Callable[..., float]
"""Function of the unknown matrices that returns the cost, which is linear in them."""


@dataclass(frozen=True)
class _Inequality:
    """Linear matrix inequality G(x) = constant + sum_j x[acting[j]] slopes[j] >= 0.

    ``constant`` (k, k); ``acting`` (a) are indices in x, and ``slopes`` (a, k, k) the matrices that belong to them.
    """

    constant: np.ndarray
    acting: np.ndarray
    slopes: np.ndarray

    def at(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.constant + np.tensordot(x[self.acting], self.slopes, 1))


def minimise(unknowns: Sequence[Unknown], cost: Cost, inequalities: Inequalities, name: str) -> list[np.ndarray]:
    """Return a solution on the central path, with a cost about :data:`GAP` (relative) above the minimum.

    Args:
        unknowns: Unknown matrices; the solution is a list with a matrix for each, in this order.
        cost: Linear cost; if it is always zero, the solution is any feasible one, as the solver finds it.
        inequalities: Affine inequalities, with entries near one.
        name: Name of the result, for error messages.

    Raises:
        DesignError: No solution was found inside the inequalities.
    """
    ends = np.cumsum([unknown.size for unknown in unknowns])
    n = int(ends[-1])

    def split(x: np.ndarray) -> list[np.ndarray]:
        parts = np.split(x, ends[:-1])
        return [unknown.matrix(part) for unknown, part in zip(unknowns, parts, strict=True)]

    constants = inequalities(*split(np.zeros(n)))
    columns = [inequalities(*split(unit)) for unit in np.eye(n)]
    found = []
    for k, constant in enumerate(constants):
        slopes = np.stack([column[k] for column in columns]) - constant
        acting = np.flatnonzero(slopes.any(axis=(1, 2)))
        found.append(_Inequality(constant, acting, slopes[acting]))
    c = np.array([cost(*split(unit)) for unit in np.eye(n)])
    if not c.any():
        return split(_solved(c, found, 0.0, name)[0])
    x, least = _inside(c, found, name)
    degree = sum(len(one.constant) for one in found)
    # A power of two, so that differences between processors in the solver's optimum rarely change t.
    t = 2.0 ** round(np.log2(degree / (GAP * max(abs(least), 1e-12))))
    return split(_centre(t * c, found, x, name))


def _solved(c: np.ndarray, found: list[_Inequality], least: float, name: str) -> tuple[np.ndarray, float]:
    """Return the x that minimises c'x, found by Clarabel, and the minimum.

    No eigenvalue of a matrix G_k(x) may be below ``least``. Clarabel runs in one thread, so that the same input gives
    the same bits on the same machine. The status "optimal_inaccurate" is accepted, because every caller recomputes its
    inequalities from the returned matrices.

    Raises:
        DesignError: The problem is infeasible or unbounded, or the solver gave up.
    """
    import cvxpy as cp  # imported here, as it takes a second that flights do not need

    x = cp.Variable(len(c))
    constraints = []
    for one in found:
        k = len(one.constant)
        linear = cp.reshape(one.slopes.reshape(len(one.acting), -1).T @ x[one.acting], (k, k), order="C")
        constraints.append(linear + (one.constant - least * np.eye(k)) >> 0)
    problem = cp.Problem(cp.Minimize(c @ x), constraints)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cp.CLARABEL, max_threads=1, direct_solve_method="qdldl")
    except cp.SolverError as error:
        raise DesignError(f"{name}: Clarabel found no solution, expected a feasible design") from error
    accepted = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
    if problem.status not in accepted:
        raise DesignError(f"{name}: status {problem.status!r}, expected one of {', '.join(accepted)}")
    return np.asarray(x.value), float(problem.value)


def _inside(c: np.ndarray, found: list[_Inequality], name: str) -> tuple[np.ndarray, float]:
    """Return an x near the minimum of c'x at which all inequalities hold strictly, and the solver's minimum."""
    failure = DesignError(f"{name}: no solution inside all inequalities, expected a feasible design")
    for least in _INSIDE:
        try:
            x, minimum = _solved(c, found, least, name)
        except DesignError as error:
            failure = error
            continue
        if _factors(found, x) is not None:
            return x, minimum
    raise failure


def _factors(found: list[_Inequality], x: np.ndarray) -> list[np.ndarray] | None:
    """Return the Cholesky factors of all matrices G_k(x), or None if one of them is not positive definite."""
    try:
        return [np.linalg.cholesky(one.at(x)) for one in found]
    except np.linalg.LinAlgError:
        return None


def _centre(c: np.ndarray, found: list[_Inequality], x: np.ndarray, name: str) -> np.ndarray:
    """Return the x that minimises c'x - sum log det G_k(x), by Newton's method from an interior point ``x``."""

    def value(at: np.ndarray, factors: list[np.ndarray]) -> float:
        return float(c @ at - 2.0 * sum(np.log(np.diag(L)).sum() for L in factors))

    factors, last = _factors(found, x), np.inf
    for _ in range(_STEPS):
        if factors is None:
            break
        gradient, hessian = c.copy(), np.zeros((len(c), len(c)))
        for one, L in zip(found, factors, strict=True):
            inverse = solve_triangular(L, np.eye(len(L)), lower=True)
            scaled = inverse @ one.slopes @ inverse.T
            gradient[one.acting] -= np.trace(scaled, axis1=1, axis2=2)
            flat = scaled.reshape(len(scaled), -1)
            hessian[np.ix_(one.acting, one.acting)] += flat @ flat.T
        size = 1.0 / np.sqrt(np.diag(hessian))
        try:
            step = -size * cho_solve(cho_factor(hessian * np.outer(size, size)), size * gradient)
        except np.linalg.LinAlgError:
            break  # x is so near a bound that rounding makes the Hessian singular
        decrement = float(np.sqrt(max(-gradient @ step, 0.0)))
        if decrement < _CONVERGED or last <= decrement < _NEAR:
            return np.asarray(x + step)
        last = decrement
        # The last step length is safe by self-concordance; a longer one is taken if it lowers the value enough.
        now = value(x, factors)
        for length in (1.0, 0.5, 0.25, 1.0 / (1.0 + decrement)):
            there = _factors(found, x + length * step)
            if there and value(x + length * step, there) < now - 0.1 * length * decrement**2:
                break
        x, factors = x + length * step, there
    raise DesignError(f"{name}: no centre found, expected a design inside its inequalities")
