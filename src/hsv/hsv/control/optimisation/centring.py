"""Linear matrix inequalities posed so that they have one answer, which every processor finds.

The optimum of a semidefinite programme need not be unique, and near it a solver's last steps are decided by rounding:
nominal gains that differ by half have the same cost to 1e-4. So what is sought is not the optimum but a point of its
central path, the minimum of

    t c'x - sum_k log det G_k(x)

where t is such that the cost is above its optimum by about the share :data:`GAP`. That function is smooth and
strictly convex: of all that cost nearly the least, its minimum is the one farthest from the bounds of all inequalities,
by the product of their eigenvalues. Newton's method finds it to rounding, from any start inside; Clarabel gives one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cvxpy as cp
import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from hsv.base.errors import DesignError
from hsv.control.optimisation.lmi import SolverReport
from hsv.control.optimisation.solver import solve

GAP = 1e-3
"""Share by which the cost of the answer is above the least one, but for a factor of at most the root of 2."""

_INSIDE = (1e-5, 1e-4, 1e-3, 1e-8)
"""Least eigenvalue of the inequalities that a start is asked for; the first for which the solver returns one inside.

What it calls inaccurate may be off by 1e-5; where there is little room, less has to do.
"""

_STEPS = 500
"""Newton steps after which the search is given up; some twenty to eighty are taken."""

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
    """Return the unknown matrices on the central path, about :data:`GAP` above the least cost.

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
    """Return the solver's minimum of c'x with no eigenvalue of an inequality below ``least``."""
    x = cp.Variable(len(c))
    constraints = []
    for one in found:
        k = len(one.constant)
        linear = cp.reshape(one.slopes.reshape(len(one.acting), -1).T @ x[one.acting], (k, k), order="C")
        constraints.append(linear + (one.constant - least * np.eye(k)) >> 0)
    report = solve(cp.Problem(cp.Minimize(c @ x), constraints), name)
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
    """Return the Cholesky factors of all inequalities at ``x``, or None where one does not hold strictly."""
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
