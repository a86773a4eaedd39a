"""Bounds of the error row by row and channel by channel: star norms (Abedor, Nagpal and Poolla 1996).

One ellipsoid for all disturbances and all outputs has one contraction, although the poles of the error system lie
decades apart. But the error is the sum of what each disturbance channel makes of it, and each of these stays in an
ellipsoid of its own: at vertex i, v+ = A_i v + g_i d with |d| <= 1 stays in {v: v' Q^-1 v <= 1} if, for a contraction
lam,

    Q - A_i Q A_i' / lam - g_i g_i' / (1 - lam) >= 0.

So the error less its centre stays in the sum of these ellipsoids over the channels, and an output row is at most
sum_j sqrt(row Q_j row') there. Every row has a sum of its own, the one that is least for it. The intersection of all
sums is invariant, and the bounds of all rows hold in it at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.optimisation import smallest_eigenvalues
from hsv.design.sets.invariant_set import TubeProblem
from hsv.model.signals import N_RIGID


def output_rows(problem: TubeProblem) -> np.ndarray:
    """Return the rows (7, n) of the outputs that are bounded: the rigid states, and F of the two inputs."""
    return np.vstack((np.eye(N_RIGID, len(problem.centre())), problem.system.F))


@dataclass(frozen=True)
class StarNorms:
    """Ellipsoids by row and channel: ``Q`` (7, d + 1, n, n) and ``contraction`` (7, d + 1).

    Rows are those of :func:`output_rows`; the last channel is the drift of the centre, see
    :meth:`hsv.design.sets.invariant_set.TubeProblem.columns`. A channel that does nothing has Q = 0.
    """

    Q: np.ndarray
    contraction: np.ndarray

    def bounds(self, problem: TubeProblem) -> np.ndarray:
        """Return the largest magnitudes (7) of the output rows about the centre, SI."""
        rows = output_rows(problem)
        return np.asarray(np.sqrt(np.einsum("ki,kjil,kl->kj", rows, self.Q, rows)).sum(axis=1))

    def residuals(self, problem: TubeProblem, centre: np.ndarray) -> np.ndarray:
        """Return the smallest eigenvalue (7, d + 1) of the inequality over the vertices; above zero: invariant.

        With Q scaled to the identity; infinite for a channel that does nothing.

        Raises:
            DesignError: A Q that is not positive definite, or a contraction that is not between 0 and 1.
        """
        A, G = problem.system.A, problem.columns(centre)
        residuals = np.full(self.contraction.shape, np.inf)
        for (row, channel), lam in np.ndenumerate(self.contraction):
            if not G[:, :, channel].any():
                continue
            if not 0.0 < lam < 1.0:
                raise DesignError(f"star norms: contraction[{row}, {channel}] = {lam:g}: expected between 0 and 1")
            try:
                factor = np.linalg.cholesky(self.Q[row, channel])
            except np.linalg.LinAlgError as error:
                raise DesignError(f"star norms: Q[{row}, {channel}] is not positive definite") from error
            inside = np.linalg.solve(factor, A @ factor)
            g = np.linalg.solve(factor, G[:, :, channel].T).T
            M = np.eye(len(factor)) - inside @ np.swapaxes(inside, 1, 2) / lam
            M -= g[:, :, None] * g[:, None, :] / (1.0 - lam)
            residuals[row, channel] = smallest_eigenvalues(M).min()
        return residuals

    def level_at_start(self, problem: TubeProblem, centre: np.ndarray, error: np.ndarray | None = None) -> float:
        """Return the largest level of terms whose sum is an ``error`` (n), by default none: at most 1, it is inside.

        Zero error is the sum of what the mid-point of each channel makes of the mean vertex in the long run, with the
        opposite sign: no mid-point is farther from zero than the half-width of its channel. The last channel takes what
        is left, that of constant channels too, which have no ellipsoid. The error is added to the term of one channel,
        for each row the one that suits. Infinite where no channel does anything and the sum is not zero.
        """
        mean = problem.system.A.mean(axis=0)
        G, acting = problem.system.G.mean(axis=0), np.flatnonzero(problem.columns(centre).any(axis=(0, 1)))
        if not acting.size:
            return float("inf") if np.any(centre if error is None else centre - error) else 0.0
        terms = np.linalg.solve(mean - np.eye(len(mean)), G * problem.disturbance.centre).T
        terms = np.vstack((terms, np.zeros(len(mean))))
        terms[acting[-1]] = -centre - terms[acting[:-1]].sum(axis=0)
        worst = 0.0
        for Q in self.Q:
            levels = np.array([_level(Q[j], terms[j]) for j in acting])
            if error is None:
                worst = max(worst, float(levels.max()))
                continue
            with_error = [_level(Q[j], terms[j] + error) for j in acting]
            others = [np.delete(levels, k).max(initial=0.0) for k in range(len(acting))]
            worst = max(worst, float(np.maximum(with_error, others).min()))
        return worst

    def certify(self, problem: TubeProblem, centre: np.ndarray) -> dict[str, Any]:
        """Recompute that every ellipsoid is invariant, and that zero error lies in their sums; return the evidence.

        Raises:
            DesignError: One is not, or it does not.
        """
        residuals, origin = self.residuals(problem, centre), self.level_at_start(problem, centre)
        if not residuals.min() > 0.0:
            row, channel = (int(i) for i in np.unravel_index(int(np.argmin(residuals)), residuals.shape))
            raise DesignError(
                f"star norms: inequality of row {row}, channel {channel} = {residuals.min():.3g}, expected above zero"
            )
        if not origin <= 1.0:
            raise DesignError(f"star norms: level of e = 0 is {origin:.6g}, expected at most 1: flights start there")
        return {"smallest_eigenvalue": float(residuals.min()), "level_of_zero_error": origin}

    def as_dict(self) -> dict[str, Any]:
        """Return the ellipsoids for JSON."""
        return {"contraction": self.contraction.tolist(), "Q": self.Q.tolist()}

    @classmethod
    def from_report(cls, report: Mapping[str, Any], problem: TubeProblem) -> StarNorms:
        """Return the ellipsoids that :meth:`as_dict` wrote, of as many rows, channels and states as ``problem`` has.

        Raises:
            DesignError: Something is missing, or is not a finite number, or there are more or fewer; or a Q is not
                symmetric: its inequality and its bounds would not be of the same ellipsoid.
        """
        _, n, d = problem.system.G.shape
        shape = (len(output_rows(problem)), d + 1)
        Q, contraction = _stored(report, "Q", (*shape, n, n)), _stored(report, "contraction", shape)
        crooked = np.argwhere(np.swapaxes(Q, 2, 3) != Q)
        if crooked.size:
            row, channel = crooked[0, :2]
            raise DesignError(f"star_norms.Q[{row}, {channel}]: expected a symmetric matrix")
        return cls(Q, contraction)


def _stored(report: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    expected = f"expected finite numbers of shape {shape}"
    try:
        values = np.array(report[name], float)
    except (LookupError, TypeError, ValueError) as error:
        raise DesignError(f"star_norms.{name}: {expected}") from error
    if values.shape != shape:
        raise DesignError(f"star_norms.{name}: shape {values.shape}, {expected}")
    if not np.all(np.isfinite(values)):
        raise DesignError(f"star_norms.{name}: {expected}")
    return values


def _level(Q: np.ndarray, v: np.ndarray) -> float:
    return float(v @ np.linalg.solve(Q, v))
