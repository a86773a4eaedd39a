"""Linear matrix inequalities posed so that they have one answer, which every processor finds.

The optimum of a semidefinite programme need not be unique, and near it a solver's last steps are decided by rounding:
nominal gains that differ by half have the same cost to 1e-4. The answer is therefore not the optimum but a point of its
central path, the minimum of

    t c'x - sum_k log det G_k(x)

where t is such that the cost is above its optimum by about the share :data:`GAP`. That function is smooth and
strictly convex. Among all points that cost nearly the least, its minimum is the one farthest from the bounds of all
inequalities, by the product of their eigenvalues. Newton's method finds it to rounding, from any start inside; Clarabel
gives one.

Unscaled, or scaled by typical sizes only, the inequalities of a fast-sampled integrator chain defeat interior-point
solvers. In coordinates whitened by a central LQR problem (:class:`Whitening`) the Lyapunov matrices are near multiples
of the identity. What one stage of a design hands to the next is rounded to the digits that mean something.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_discrete_are, solve_triangular

from hsv.base.errors import DesignError


@dataclass(frozen=True)
class SolverReport:
    """Report on a solved problem: versions, ``status``, ``iterations`` and the ``objective`` returned."""

    solver: str
    modelling: str
    status: str
    iterations: int
    objective: float

    def as_dict(self) -> dict[str, Any]:
        """Return the report for JSON, the same at every run."""
        return asdict(self)


def smallest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the smallest eigenvalue (r) of each symmetric matrix (r, k, k)."""
    return np.linalg.eigvalsh(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))[..., 0]


def spectral_radii(matrices: np.ndarray) -> np.ndarray:
    """Return the spectral radius (r) of each matrix (r, n, n)."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))


def image(Q: np.ndarray, name: str, M: np.ndarray, *columns: np.ndarray) -> np.ndarray:
    """Return the largest singular value (...) of L^-1 [M L, columns] with Q = L L'.

    At most 1: M takes the ellipsoid x' Q^-1 x <= 1 into itself. The smallest eigenvalue of [Q, (M Q)'; M Q, Q], scaled
    to a unit diagonal, is 1 less this value.

    Args:
        Q: (n, n) the matrix of the ellipsoid.
        name: Its name, for the error message.
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
    """Return Q^-1, symmetric."""
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


VERTEX_DIGITS = 12
"""Digits kept of vertices, below the scales of the model: two processors agree on ten, but the slow modes in the Bode
plot need twelve. Entries that are zero in the physical model are below 1e-14 and become zero."""

GAIN_DIGITS = 6
"""Digits kept of gains, below the scales of their problem; processors agree on eight."""

MATRIX_DIGITS = 11
"""Digits kept of ellipsoids, their centres and multipliers, below their own sizes. Processors agree on eight, but an
ellipsoid must also be invariant and nested in its thinnest direction, where its entries cancel."""

BOUND_DIGITS = 6
"""Digits kept of bounds of disturbances and inputs."""


def rounded(values: np.ndarray, size: Any, digits: int) -> np.ndarray:
    """Return ``values`` as decimal numbers with ``digits`` digits below the leading one of each ``size``."""
    values = np.asarray(values, float)
    leading = np.floor(np.log10(np.broadcast_to(np.asarray(size, float), values.shape))).astype(int)
    flat = [round(v, digits - k) for v, k in zip(values.ravel().tolist(), leading.ravel().tolist(), strict=True)]
    # Without negative zeros.
    return np.array(flat).reshape(values.shape) + 0.0


def rounded_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return a positive definite matrix (n, n) rounded, below the roots of its diagonal."""
    root = np.sqrt(np.diag(matrix))
    return rounded(0.5 * (matrix + matrix.T), np.outer(root, root), MATRIX_DIGITS)


def outward(values: np.ndarray) -> np.ndarray:
    """Return ``values`` rounded away from zero to :data:`BOUND_DIGITS` significant digits.

    A value that exceeds such a number by a relative 1e-12 or less becomes that number.
    """
    values = np.asarray(values, float)
    size = np.where(values == 0.0, 1.0, np.abs(values))
    quantum = 10.0 ** (np.floor(np.log10(size)) - BOUND_DIGITS + 1)
    # The margin is for a value that is a multiple but for the rounding of the division.
    multiples = np.ceil(np.abs(values) / quantum * (1.0 - 1e-12))
    return rounded(np.sign(values) * multiples * quantum, size, BOUND_DIGITS)


@dataclass(frozen=True)
class Whitening:
    """New coordinates: state z = ``to_white`` x, input v = u / ``input_scale``.

    ``to_white`` and its inverse ``from_white`` (n, n); ``input_scale`` (m).
    """

    to_white: np.ndarray
    from_white: np.ndarray
    input_scale: np.ndarray

    def dynamics(self, A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return A (..., n, n) and B (..., n, m) in the new coordinates."""
        return self.to_white @ A @ self.from_white, self.to_white @ B * self.input_scale

    def gain(self, K: np.ndarray) -> np.ndarray:
        """Return a gain (m, n), found in the new coordinates, in the original ones."""
        return np.asarray(self.input_scale[:, None] * (K @ self.to_white))

    def covariance(self, N: np.ndarray) -> np.ndarray:
        """Return a matrix N (n, n) of the kind x' N^-1 x <= 1, found in the new coordinates, in the original ones."""
        return _symmetric(self.from_white @ N @ self.from_white.T)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (matrix + matrix.T))


def lqr_whitening(A: np.ndarray, B: np.ndarray, state_scale: np.ndarray, input_scale: np.ndarray) -> Whitening:
    """Return the whitening by the Cholesky factor of the Riccati solution at the mean of the vertices.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m) vertices.
        state_scale: (n) deviations that weigh equally in the LQR cost, SI.
        input_scale: (m) inputs that weigh as much, SI.

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
"""Relative gap between the cost of the solution and the minimum, up to a factor of at most the root of 2."""

_INSIDE = (1e-5, 1e-4, 1e-3, 1e-8)
"""Smallest eigenvalues of the inequalities to require of a start, tried in order until the solver returns one inside.

What it calls inaccurate may be off by 1e-5; where there is little room, less has to do.
"""

_STEPS = 500
"""Maximum number of Newton steps; about twenty to eighty are needed."""

_CONVERGED = 1e-7
"""Newton decrement after which one more step leaves nothing but rounding."""

_NEAR = 1e-4
"""Newton decrement below which one that no longer falls is rounding, too."""


@dataclass(frozen=True)
class Unknown:
    """A matrix sought: ``shape`` (m, n), or symmetric (n, n)."""

    shape: tuple[int, int]
    symmetric: bool = False

    @property
    def size(self) -> int:
        """Number of its free entries."""
        m, n = self.shape
        return n * (n + 1) // 2 if self.symmetric else m * n

    def matrix(self, x: np.ndarray) -> np.ndarray:
        """Return the matrix with the free entries ``x``, row by row; of a symmetric one, of its upper triangle."""
        if not self.symmetric:
            return x.reshape(self.shape)
        value = np.zeros(self.shape)
        value[np.triu_indices(len(value))] = x
        return np.asarray(value + np.triu(value, 1).T)


Inequalities = Callable[..., Sequence[np.ndarray]]
"""Function from the unknown matrices to symmetric matrices, affine in them, that must be positive semidefinite."""

Cost = Callable[..., float]
"""Function from the unknown matrices to a linear cost."""


@dataclass(frozen=True)
class _Inequality:
    """G(x) = ``constant`` (k, k) + sum_j x[``acting``[j]] ``slopes`` (a, k, k)[j]."""

    constant: np.ndarray
    acting: np.ndarray
    slopes: np.ndarray

    def at(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.constant + np.tensordot(x[self.acting], self.slopes, 1))


def minimise(
    unknowns: Sequence[Unknown], cost: Cost, inequalities: Inequalities, name: str
) -> tuple[list[np.ndarray], SolverReport]:
    """Return the unknown matrices on the central path, about :data:`GAP` above the minimum cost.

    Args:
        unknowns: Unknown matrices.
        cost: Linear; if it is zero throughout, the answer is the solver's.
        inequalities: Affine, with entries near one.
        name: Name of the result, for error messages.

    Raises:
        DesignError: No solution inside the inequalities.
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
        x, report = _solved(c, found, 0.0, name)
        return split(x), report
    x, report = _inside(c, found, name)
    degree = sum(len(one.constant) for one in found)
    # A power of two: the solver's optimum, which has few digits that count, chooses among few.
    t = 2.0 ** round(np.log2(degree / (GAP * max(abs(report.objective), 1e-12))))
    x = _centre(t * c, found, x, name)
    return split(x), replace(report, objective=float(c @ x))


def _solved(c: np.ndarray, found: list[_Inequality], least: float, name: str) -> tuple[np.ndarray, SolverReport]:
    """Return the minimum of c'x by Clarabel, in one thread, with no eigenvalue of an inequality below ``least``.

    The same input gives the same bits on the same machine. "optimal_inaccurate" passes: every caller recomputes its
    inequalities from the returned matrices.

    Raises:
        DesignError: Infeasible, unbounded, or the solver gave up.
    """
    import cvxpy as cp  # takes a second, which a flight need not pay

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
    statistics = problem.solver_stats
    report = SolverReport(
        solver=f"Clarabel {version('clarabel')}",
        modelling=f"cvxpy {version('cvxpy')}",
        status=str(problem.status),
        iterations=int(statistics.num_iters or 0),
        objective=float(problem.value),
    )
    return np.asarray(x.value), report


def _inside(c: np.ndarray, found: list[_Inequality], name: str) -> tuple[np.ndarray, SolverReport]:
    """Return a point near the minimum of c'x at which all inequalities hold strictly."""
    failure = DesignError(f"{name}: no solution inside all inequalities, expected a feasible design")
    for least in _INSIDE:
        try:
            x, report = _solved(c, found, least, name)
        except DesignError as error:
            failure = error
            continue
        if _factors(found, x) is not None:
            return x, report
    raise failure


def _factors(found: list[_Inequality], x: np.ndarray) -> list[np.ndarray] | None:
    """Return the Cholesky factors of all inequalities at ``x``, or None if one does not hold strictly."""
    try:
        return [np.linalg.cholesky(one.at(x)) for one in found]
    except np.linalg.LinAlgError:
        return None


def _centre(c: np.ndarray, found: list[_Inequality], x: np.ndarray, name: str) -> np.ndarray:
    """Return the minimum of c'x - sum log det G_k(x), by Newton's method from ``x`` inside."""

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
            break  # so near a bound that rounding has taken the curvature along it
        decrement = float(np.sqrt(max(-gradient @ step, 0.0)))
        if decrement < _CONVERGED or last <= decrement < _NEAR:
            return np.asarray(x + step)
        last = decrement
        # The last length is safe by self-concordance; longer ones are taken where they pay.
        now = value(x, factors)
        for length in (1.0, 0.5, 0.25, 1.0 / (1.0 + decrement)):
            there = _factors(found, x + length * step)
            if there and value(x + length * step, there) < now - 0.1 * length * decrement**2:
                break
        x, factors = x + length * step, there
    raise DesignError(f"{name}: no centre found, expected a design inside its inequalities")
