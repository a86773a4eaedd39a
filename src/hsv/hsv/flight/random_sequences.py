"""Random sequences of the model's vertices and of disturbances that try to drive the error e out of an ellipsoid.

They test the invariance of the ellipsoid without the matrix inequality that certifies it. They start at e = 0, where
flights start, or on the boundary. Kinds: *iid* draws the vertex and the signs of all disturbances anew at every step;
*held* keeps them; *switching* keeps them for random times; *adversarial* keeps vertices for random times and picks the
signs one by one so that they push outwards. Every twenty-fifth adversarial sequence also picks the worst vertex.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.base.processes import over_threads
from hsv.core import doubles, lib

KINDS = ("iid", "held", "switching", "adversarial")
"""Kinds of sequences; sequence j is of the kind with index j mod 4."""

_BATCH = 2500

_WIDEST = 32
"""Largest number of states of the error, as in ``core/sequences.h``."""


def random_sequences(
    A: np.ndarray, columns: np.ndarray, centre: np.ndarray, Q: np.ndarray, sequences: int, steps: int, seed: int
) -> dict[str, Any]:
    """Return the largest levels that random sequences reach: overall, and for each start by kind; 1 is the boundary.

    The result repeats ``sequences``, ``steps`` and ``seed``. Its bits do not depend on the number of threads.

    Args:
        A: (r, n, n) matrices of the closed loop at the r vertices; they act on e - ``centre``.
        columns: (r, n, d + 1) changes of e - ``centre`` in a step: by each of d disturbances at 1, then a constant one.
        centre: (n,) centre of the ellipsoid.
        Q: (n, n) its matrix; the level of an error e is (e - centre)' Q^-1 (e - centre).
        sequences: Number of sequences.
        steps: Number of steps of each sequence.
        seed: Seed of the random numbers.
    """
    factor = np.linalg.cholesky(Q)
    A, G = np.linalg.solve(factor, A @ factor), np.linalg.solve(factor, columns)
    start = np.linalg.solve(factor, -centre)
    n = len(factor)
    # Padded with zeros, so that the inner loops run over full vector registers.
    width = -(-n // 4) * 4
    both = np.zeros((len(A), n + G.shape[2], width))
    both[:, :n, :n], both[:, n:, :n] = np.swapaxes(A, 1, 2), np.swapaxes(G, 1, 2)
    assert width <= _WIDEST
    begin = np.zeros(width)
    begin[:n] = start

    def batch(first: int) -> np.ndarray:
        worst = np.zeros((len(KINDS), 2))
        end = min(first + _BATCH, sequences)
        lib.hsv_sample_sequences(*both.shape, doubles(both), n, doubles(begin), first, end, steps, seed, doubles(worst))
        return worst

    worst = np.max(over_threads(batch, range(0, sequences, _BATCH)), axis=0)
    return {
        "sequences": sequences,
        "steps": steps,
        "seed": seed,
        "worst_level": float(worst.max()),
        "worst_level_from_zero": {kind: float(w) for kind, w in zip(KINDS, worst[:, 0], strict=True)},
        "worst_level_from_boundary": {kind: float(w) for kind, w in zip(KINDS, worst[:, 1], strict=True)},
    }
