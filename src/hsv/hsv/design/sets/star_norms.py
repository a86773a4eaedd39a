"""Star norms (Abedor, Nagpal and Poolla 1996): bounds of each output row of the error, as sums over the channels.

One ellipsoid for all disturbances and outputs has one contraction, although the poles of the error system lie decades
apart. But the error minus its centre is the sum of the responses v_j to the single disturbance channels j, and each
response stays in a separate ellipsoid. At vertex i, v+ = A_i v + g_i d with |d| <= 1 stays in {v: v' Q^-1 v <= 1} if,
for a contraction lam,

    Q - A_i Q A_i' / lam - g_i g_i' / (1 - lam) >= 0.

An output row of the error is then at most sum_j sqrt(row Q_j row') from its centre. Each row has its own ellipsoids,
which make its bound small. The intersection, over all rows, of the Minkowski sums of their ellipsoids is invariant, and
the bounds of all rows hold in it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cholesky

from hsv.base.errors import DesignError
from hsv.design.tube_problem import TubeProblem
from hsv.lmi.semidefinite import Unknown, ellipsoid_norms, minimise, rounded_matrix, spectral_radii

_INFLATION = 1.002
"""Factor on Q that keeps the ellipsoid invariant after rounding."""

_REGULAR = 1e-9
"""Multiple of the unit matrix added to the scaled Gramian, which is singular if the channel excites few states only."""

_SHARES = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Values of 1 - lam to try, relative to 1 - rho^2, rho the largest spectral radius of a vertex; at 1 no Q exists."""

_CONTRACTION_DIGITS = 8
"""Decimals to which a contraction is rounded; processors agree on more."""

_BOUNDED = 1e-5
"""Weight of the trace of Q relative to row Q row'; it bounds Q in directions that do not affect the row."""

_NEGLIGIBLE = 1e-12
"""Share of the sum below which further terms of a Gramian are omitted."""


@dataclass(frozen=True)
class StarNorms:
    """Ellipsoids for each output row and disturbance channel: ``Q`` (7, d + 1, n, n) and ``contraction`` (7, d + 1).

    The rows are those of :meth:`TubeProblem.output_rows`, the channels those of :meth:`TubeProblem.columns`; the last
    channel is the drift of the centre. A channel without effect has Q = 0.
    """

    Q: np.ndarray
    contraction: np.ndarray

    def bounds(self, problem: TubeProblem) -> np.ndarray:
        """Return the bounds of the seven output rows, as distances from their values at the centre, SI."""
        rows = problem.output_rows()
        return np.asarray(np.sqrt(np.einsum("ki,kjil,kl->kj", rows, self.Q, rows)).sum(axis=1))

    def residuals(self, problem: TubeProblem, centre: np.ndarray) -> np.ndarray:
        """Return the margin of the module's inequality, shape (7, d + 1), by row and channel; above zero: it holds.

        It is the left side's smallest eigenvalue over all vertices, with Q scaled to I; infinite if without effect.

        Raises:
            DesignError: A Q is not positive definite.
        """
        A, G = problem.system.A, problem.columns(centre)
        residuals = np.full(self.contraction.shape, np.inf)
        for (row, channel), lam in np.ndenumerate(self.contraction):
            g = G[:, :, channel, None] / np.sqrt(1.0 - lam)
            if g.any():
                reach = ellipsoid_norms(self.Q[row, channel], f"star norms: Q[{row}, {channel}]", A / np.sqrt(lam), g)
                residuals[row, channel] = 1.0 - reach.max() ** 2
        return residuals

    def level_at_start(self, problem: TubeProblem, centre: np.ndarray, error: np.ndarray | None = None) -> float:
        """Return an upper bound of the level of an initial ``error`` (None: zero) in the set of the star norms.

        The error minus the centre is split into terms v, one for each channel. The result is the largest v' Q^-1 v over
        all rows and channels; if it is at most 1, each v lies in its ellipsoid, and the error in the set. For zero
        error, the v of a channel is minus the mean vertex's steady response to the channel's mid-point, but the last
        channel with an effect takes the remainder. Another ``error`` is added, in each row, to the one v that makes
        the result smallest. If no channel has an effect, the result is 0 for an error at the centre, else infinite.
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
        """Check that all ellipsoids are invariant and that e = 0 lies in their sums; return the evidence, for JSON.

        Raises:
            DesignError: An ellipsoid is not invariant, or e = 0 could not be shown to lie inside.
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
        """Return the ellipsoids that :meth:`as_dict` wrote, for the rows, channels and states of ``problem``.

        Raises:
            DesignError: Values are missing or not finite, have another shape, or are not symmetric.
        """
        _, n, d = problem.system.G.shape
        found = []
        for name, shape in (("Q", (7, d + 1, n, n)), ("contraction", (7, d + 1))):
            try:
                values = np.array(report[name], float)
            except (LookupError, TypeError, ValueError):
                values = np.zeros(0)
            if values.shape != shape or not np.all(np.isfinite(values)):
                raise DesignError(f"star_norms.{name}: expected finite numbers of shape {shape}")
            found.append(values)
        if np.any(np.swapaxes(found[0], 2, 3) != found[0]):
            raise DesignError("star_norms.Q: expected symmetric matrices")
        return cls(*found)


def _level(Q: np.ndarray, v: np.ndarray) -> float:
    return float(v @ np.linalg.solve(Q, v))


def star_norms(
    problem: TubeProblem, centre: np.ndarray, progress: Callable[[int, int], None] = lambda done, total: None
) -> StarNorms:
    """Return the star norms: ellipsoids that make the bound of each output row small.

    Args:
        problem: Error system and disturbances.
        centre: (n) centre of the set.
        progress: Called with the number of ellipsoids found and their total.

    Raises:
        DesignError: A vertex is not stable, or a row and channel have no ellipsoid.
    """
    rows, G = problem.output_rows(), problem.columns(centre)
    A, shape = problem.system.A, (len(rows), G.shape[2])
    margin = 1.0 - float(spectral_radii(A).max()) ** 2
    if not margin > 0.0:
        raise DesignError("star norms: a vertex is not stable, expected spectral radii below 1")
    contractions = [round(1.0 - share * margin, _CONTRACTION_DIGITS) for share in _SHARES]
    Q, chosen = np.zeros((*shape, *A.shape[1:])), np.zeros(shape)
    for done, (row, channel) in enumerate(np.ndindex(shape)):
        progress(done, chosen.size)
        Q[row, channel], chosen[row, channel] = _least(A, G[:, :, channel], rows[row], contractions)
    progress(chosen.size, chosen.size)
    return StarNorms(Q, chosen)


def _least(A: np.ndarray, g: np.ndarray, row: np.ndarray, contractions: Sequence[float]) -> tuple[np.ndarray, float]:
    """Return a Q (n, n) that gives ``row`` a small bound, and its contraction.

    The contractions are tried in ascending order of a lower bound of row Q row'; the first with a solution is taken.
    This lower bound is the largest row Q row' with Q the Gramian of a single vertex; no Q common to all is below it.
    """
    if not g.any():
        return np.zeros(A.shape[1:]), contractions[0]
    failure: DesignError | None = None
    for contraction in sorted(contractions, key=lambda one: np.max(row @ _gramians(A, _outer(g), one) @ row)):
        try:
            return _solve(A, g, row, contraction), contraction
        except DesignError as error:
            failure = error
    raise DesignError(f"no star norm for a contraction in {contractions}: {failure}")


def _solve(A: np.ndarray, g: np.ndarray, row: np.ndarray, contraction: float) -> np.ndarray:
    """Return the Q (n, n) with the smallest row Q row' that satisfies the module's inequality, slightly enlarged.

    A small multiple of the trace, in the coordinates of :func:`_coordinates`, is added to the cost to keep Q bounded.

    Raises:
        DesignError: The inequality has no solution for this ``contraction``.
    """
    T = _coordinates(A, g, contraction)
    inside, columns, output = np.linalg.solve(T, A @ T), np.linalg.solve(T, g.T).T, row @ T
    output /= np.linalg.norm(output)

    def inequalities(Q: np.ndarray) -> list[np.ndarray]:
        return [
            Q - A_i @ Q @ A_i.T / contraction - np.outer(g_i, g_i) / (1.0 - contraction)
            for A_i, g_i in zip(inside, columns, strict=True)
        ]

    (Q,) = minimise(
        (Unknown((len(T), len(T)), symmetric=True),),
        lambda Q: float(output @ Q @ output + _BOUNDED * np.trace(Q)),
        inequalities,
        f"star norms, contraction {contraction}",
    )
    return rounded_matrix(_INFLATION * T @ Q @ T.T)


def _coordinates(A: np.ndarray, g: np.ndarray, contraction: float) -> np.ndarray:
    """Return T (n, n) such that the mean vertex's Gramian is near the identity in the coordinates z of v = T z."""
    held = _outer(g).mean(axis=0, keepdims=True)
    gramian = _gramians(A.mean(axis=0, keepdims=True), held, contraction)[0]
    size = np.sqrt(gramian.diagonal())
    size = np.where(size > 0.0, size, 1.0)  # zero for a state that the channel does not excite
    scaled = 0.5 * (gramian + gramian.T) / np.outer(size, size)
    return np.asarray(size[:, None] * cholesky(scaled + _REGULAR * np.eye(len(size)), lower=True))


def _gramians(A: np.ndarray, held: np.ndarray, contraction: float) -> np.ndarray:
    """Return the Gramian of each A: Q = A Q A' / c + ``held`` / (1 - c); ``held`` is g g', c the ``contraction``."""
    power, gramian = A / np.sqrt(contraction), held / (1.0 - contraction)

    def diagonals(matrices: np.ndarray) -> np.ndarray:
        return np.asarray(np.diagonal(matrices, axis1=1, axis2=2))

    # Each pass doubles the number of terms of the sum. The sizes of the states are too different for a Lyapunov solver.
    while np.any(diagonals(term := power @ gramian @ np.swapaxes(power, 1, 2)) > _NEGLIGIBLE * diagonals(gramian)):
        gramian, power = gramian + term, power @ power
    return gramian


def _outer(g: np.ndarray) -> np.ndarray:
    return np.asarray(g[:, :, None] * g[:, None, :])
