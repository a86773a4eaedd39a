"""Random sequences of vertices and disturbances against an ellipsoid: evidence that needs no faith in the inequality.

Sequences start at e = 0, where flights start, or on the boundary of the set. Kinds: *iid* draws vertex and signs of
all disturbances anew at every step; *held* keeps them; *switching* keeps them for random times; *adversarial* keeps
vertices for random times and picks the signs that push outwards most, every twenty-fifth of them the vertex too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.base.processes import over_threads
from hsv.core import doubles, lib
from hsv.design.sets.ellipsoid_set import EllipsoidSet

KINDS = ("iid", "held", "switching", "adversarial")
"""Sequence j is of kind j mod 4."""

_BATCH = 2500

_WIDEST = 32
"""Numbers in a state, as in ``core/sequences.h``."""


def sample(found: EllipsoidSet, sequences: int, steps: int, seed: int) -> dict[str, Any]:
    """Return the worst level reached, by kind and start; the same ``seed`` gives the same bits on any thread count."""
    factor = np.linalg.cholesky(found.Q)
    A = np.linalg.solve(factor, found.problem.system.A @ factor)
    G = np.linalg.solve(factor, found.problem.columns(found.centre))
    start = np.linalg.solve(factor, -found.centre)
    # Padded with zeros: the inner loops then run over whole vectors.
    width = -(-len(factor) // 4) * 4
    columns = np.zeros((len(A), A.shape[2] + G.shape[2], width))
    columns[:, : A.shape[2], : len(factor)] = np.swapaxes(A, 1, 2)
    columns[:, A.shape[2] :, : len(factor)] = np.swapaxes(G, 1, 2)
    assert width <= _WIDEST
    begin = np.zeros(width)
    begin[: len(factor)] = start

    def batch(first: int) -> np.ndarray:
        worst = np.zeros((len(KINDS), 2))
        end = min(first + _BATCH, sequences)
        lib.hsv_sample_sequences(
            *columns.shape, doubles(columns), len(factor), doubles(begin), first, end, steps, seed, doubles(worst)
        )
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
