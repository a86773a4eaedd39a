"""Finding the ellipsoids of :mod:`hsv.design.sets.star_norms`, each the least for its row and channel."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.linalg import cholesky

from hsv.base.errors import DesignError
from hsv.control.optimisation import Unknown, minimise, rounded_matrix, spectral_radii
from hsv.design.sets.invariant_set import TubeProblem
from hsv.design.sets.star_norms import StarNorms, output_rows

_INFLATION = 1.002
"""Factor on Q, so that it is invariant as rounded, too."""

_REGULAR = 1e-9
"""Share of the unit matrix in the coordinates of the search: a channel that excites few states makes them singular."""

_SHARES = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""What is tried: 1 - lam as a share of 1 - rho^2, rho the largest spectral radius of a vertex; at 1 there is no Q."""

_CONTRACTION_DIGITS = 8
"""Decimals of a contraction: processors agree on more."""

_BOUNDED = 1e-5
"""Weight of the trace of Q beside that of the row, so that Q is bounded in directions that the row does not see."""

_NEGLIGIBLE = 1e-12
"""Share of the sum below which further terms of a Gramian are left out."""


def star_norms(
    problem: TubeProblem, centre: np.ndarray, progress: Callable[[int, int], None] = lambda done, total: None
) -> StarNorms:
    """Return the ellipsoids that bound each output row the least.

    Args:
        problem: Error system and disturbances.
        centre: (n) centre of the set.
        progress: Told how many ellipsoids of all are found.

    Raises:
        DesignError: A row and a channel for which there is none.
    """
    rows, G = output_rows(problem), problem.columns(centre)
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
    """Return the Q that bounds ``row`` the least, and its contraction.

    At which contraction that is, the vertices tell one by one: the Gramian of each bounds every Q of all from below.
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
    """Return the Q of the least row Q row' at one contraction.

    Raises:
        DesignError: There is none.
    """
    T = _coordinates(A, g, contraction)
    inside, columns, output = np.linalg.solve(T, A @ T), np.linalg.solve(T, g.T).T, row @ T
    output /= np.linalg.norm(output)

    def inequalities(Q: np.ndarray) -> list[np.ndarray]:
        return [
            Q - A_i @ Q @ A_i.T / contraction - np.outer(g_i, g_i) / (1.0 - contraction)
            for A_i, g_i in zip(inside, columns, strict=True)
        ]

    (Q,), _ = minimise(
        (Unknown((len(T), len(T)), symmetric=True),),
        lambda Q: float(output @ Q @ output + _BOUNDED * np.trace(Q)),
        inequalities,
        f"star norms, contraction {contraction}",
    )
    return rounded_matrix(_INFLATION * T @ Q @ T.T)


def _coordinates(A: np.ndarray, g: np.ndarray, contraction: float) -> np.ndarray:
    """Return T (n, n) such that in x = T z the Q of the mean vertex alone would be near the identity."""
    held = _outer(g).mean(axis=0, keepdims=True)
    gramian = _gramians(A.mean(axis=0, keepdims=True), held, contraction)[0]
    size = np.sqrt(gramian.diagonal())
    size = np.where(size > 0.0, size, 1.0)  # of a state that the channel does not excite
    scaled = 0.5 * (gramian + gramian.T) / np.outer(size, size)
    return np.asarray(size[:, None] * cholesky(scaled + _REGULAR * np.eye(len(size)), lower=True))


def _gramians(A: np.ndarray, held: np.ndarray, contraction: float) -> np.ndarray:
    """Return the least Q (r, n, n) with Q = A Q A' / lam + ``held`` / (1 - lam), for each A (r, n, n) alone."""
    power, gramian = A / np.sqrt(contraction), held / (1.0 - contraction)

    def diagonals(matrices: np.ndarray) -> np.ndarray:
        return np.asarray(np.diagonal(matrices, axis1=1, axis2=2))

    # By doubling the number of terms of the sum: sizes of the states lie many decades apart, too many for a solver.
    while np.any(diagonals(term := power @ gramian @ np.swapaxes(power, 1, 2)) > _NEGLIGIBLE * diagonals(gramian)):
        gramian, power = gramian + term, power @ power
    return gramian


def _outer(g: np.ndarray) -> np.ndarray:
    return np.asarray(g[:, :, None] * g[:, None, :])
