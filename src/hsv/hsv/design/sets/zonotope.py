"""Zonotope outer bound with vertex absorption: Z = sum over k of A_0^k (W + W_a), A_0 the mean vertex.

Every vertex is the mean one plus a difference: A_i e + G_i d = A_0 e + G_0 d + [(A_i - A_0) e + (G_i - G_0) d]. The
bracket is absorbed by a box W_a that bounds it for all e in Z; Z depends on W_a, so both are found by a fixed point,
verified at the end. The sum is taken up to step K and the rest, A_0^K Z, bounded by the box |A_0^K| z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from hsv.base.errors import DesignError
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem

_ROUNDS = 10000
_MARGIN = 1e-6
"""Relative excess of W_a over what it has to absorb."""

_TAIL = 1e-3
"""Largest row sum of |A_0^K|, in units of the states' own bounds, at which the sum ends."""


@dataclass(frozen=True)
class ZonotopeSet(InvariantSet):
    """The set with its generators: ``powers`` A_0^k (K, n, n), ``columns`` G_0 (n, d), boxes W_a and the rest's (n)."""

    powers: np.ndarray
    columns: np.ndarray
    absorbed: np.ndarray
    rest: np.ndarray

    kind = "zonotope"

    def level(self, error: np.ndarray) -> np.ndarray:
        """Return the square of the least factor on the set that holds e - c, by a linear programme each."""
        errors = np.atleast_2d(error - self.centre)
        return np.array([self._factor(e) ** 2 for e in errors]).reshape(error.shape[:-1])

    def _factor(self, e: np.ndarray) -> float:
        base = np.concatenate((self.columns, np.diag(self.absorbed)), axis=1)
        generators = np.concatenate((*(self.powers @ base), np.diag(self.rest)), axis=1)
        # The largest s with s e = generators m, |m| <= 1.
        g = generators.shape[1]
        equality = np.concatenate((generators, -e[:, None]), axis=1) / self.half_width[:, None]
        found = linprog(
            np.append(np.zeros(g), -1.0),
            A_eq=equality,
            b_eq=np.zeros(len(e)),
            bounds=[(-1.0, 1.0)] * g + [(0.0, 1e9)],
            method="highs",
        )
        return float(-1.0 / found.fun) if found.status == 0 and found.fun < 0.0 else np.inf

    def certify(self) -> dict[str, Any]:
        """Recompute that W_a bounds the contribution of the vertices over the set."""
        sums = _Sums.of(self.problem, self.powers, self.columns)
        margin = 1.0 - sums.needed(self.problem, self.centre, self.absorbed) / self.absorbed
        if not margin.min() >= 0.0:
            raise DesignError(f"zonotope: absorbs {-margin.min():.3g} too little, expected nothing left over")
        return {"absorption_margins": margin.tolist()}


def zonotope(problem: TubeProblem) -> ZonotopeSet:
    """Return the zonotope.

    Raises:
        DesignError: The absorbed differences grow without bound.
    """
    centre = problem.centre()
    columns = problem.columns(centre).mean(axis=0)
    powers = _powers(problem.system.A.mean(axis=0), columns)
    sums = _Sums.of(problem, powers, columns)
    absorbed = np.zeros(len(centre))
    for _ in range(_ROUNDS):
        needed = sums.needed(problem, centre, absorbed)
        if np.all(needed <= absorbed):
            n = len(centre)
            support = sums.support(absorbed)
            z, feedback = support[:n], support[n : n + len(problem.system.F)]
            rest = np.abs(powers[-1] @ problem.system.A.mean(axis=0)) @ z
            return ZonotopeSet(problem, centre, z, feedback, powers, columns, absorbed, rest)
        absorbed = needed * (1.0 + _MARGIN)
        if not np.all(absorbed < 1e6):
            break
    raise DesignError("zonotope: absorbed differences grow without bound, expected a fixed point")


def _powers(A: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return I, A, ... A^(K-1), where |A^K| no longer matters."""
    powers = [np.eye(len(A))]
    reached = np.abs(columns).sum(axis=1)
    while True:
        new = A @ powers[-1]
        reached += np.abs(new @ columns).sum(axis=1)
        if np.max(np.abs(new) @ reached / reached) < _TAIL:
            return np.stack(powers)
        powers.append(new)


@dataclass(frozen=True)
class _Sums:
    """Support functions of Z, affine in W_a: in unit directions, in those of F, and of all rows of A_i - A_0.

    ``fixed`` (k) from the disturbances, ``of_absorbed`` (k, n) from W_a, ``last`` (k, n) rows times A_0^K.
    """

    fixed: np.ndarray
    of_absorbed: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, problem: TubeProblem, powers: np.ndarray, columns: np.ndarray) -> _Sums:
        A = problem.system.A
        n = A.shape[1]
        directions = np.concatenate((np.eye(n), problem.system.F, (A - A.mean(axis=0)).reshape(-1, n)))
        rows = np.einsum("kn,pnm->kpm", directions, powers)
        last = directions @ powers[-1] @ A.mean(axis=0)
        return cls(np.abs(rows @ columns).sum(axis=(1, 2)), np.abs(rows).sum(axis=1), np.abs(last))

    def support(self, absorbed: np.ndarray) -> np.ndarray:
        n = len(absorbed)
        partial = self.fixed + self.of_absorbed @ absorbed
        z = np.linalg.solve(np.eye(n) - self.last[:n], partial[:n])
        return np.asarray(partial + self.last @ z)

    def needed(self, problem: TubeProblem, centre: np.ndarray, absorbed: np.ndarray) -> np.ndarray:
        """Return the box (n) of the differences between the vertices and the mean one, over the set."""
        r, n, _ = problem.system.A.shape
        states = self.support(absorbed)[-r * n :].reshape(r, n)
        columns = problem.columns(centre)
        inputs = np.abs(columns - columns.mean(axis=0)).sum(axis=2)
        # The floor keeps rows that nothing enters (filter states) from asking for less than nothing.
        return np.asarray(np.maximum((states + inputs).max(axis=0), 1e-15))
