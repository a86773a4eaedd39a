"""Random sequences of vertices and disturbances against an ellipsoid: evidence that needs no faith in the inequality.

Sequences start at e = 0, where flights start, or on the boundary of the set. Kinds: *iid* draws vertex and signs of
all disturbances anew at every step; *held* keeps them; *switching* keeps them for random times; *adversarial* keeps
vertices for random times and picks the signs that push outwards most, every twenty-fifth of them the vertex too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.compiled import njit
from hsv.design.sets.ellipsoid_set import EllipsoidSet
from hsv.threads import over_threads

KINDS = ("iid", "held", "switching", "adversarial")
"""Sequence j is of kind j mod 4."""

_BATCH = 2500


def sample(found: EllipsoidSet, sequences: int, steps: int, seed: int) -> dict[str, Any]:
    """Return the worst level reached, by kind and start; the same ``seed`` gives the same bits on any thread count."""
    factor = np.linalg.cholesky(found.Q)
    A = np.linalg.solve(factor, found.problem.system.A @ factor)
    G = np.linalg.solve(factor, found.problem.columns(found.centre))
    start = np.linalg.solve(factor, -found.centre)
    # Columns contiguous and padded: the inner loops then run over whole vectors.
    width = -(-len(factor) // 4) * 4
    columns = np.zeros((len(A), A.shape[2] + G.shape[2], width))
    columns[:, : A.shape[2], : len(factor)] = np.swapaxes(A, 1, 2)
    columns[:, A.shape[2] :, : len(factor)] = np.swapaxes(G, 1, 2)
    begin = np.zeros(width)
    begin[: len(factor)] = start

    def batch(first: int) -> np.ndarray:
        worst = np.zeros((len(KINDS), 2))
        _run(columns, len(factor), begin, first, min(first + _BATCH, sequences), steps, np.uint64(seed), worst)
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


@njit(cache=True, nogil=True)
def _mix(state: np.uint64) -> np.uint64:
    # splitmix64: a counter in, 64 good bits out.
    z = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, nogil=True)
def _advance(matrix: np.ndarray, n: int, signs: np.uint64, v: np.ndarray, new: np.ndarray) -> None:
    width = len(v)
    new[:] = 0.0
    for j in range(n):
        column, value = matrix[j], v[j]
        for i in range(width):
            new[i] += column[i] * value
    last = len(matrix) - 1
    for j in range(n, last):
        column = matrix[j]
        value = 1.0 if (signs >> np.uint64(j)) & np.uint64(1) else -1.0
        for i in range(width):
            new[i] += column[i] * value
    column = matrix[last]
    for i in range(width):
        new[i] += column[i]


@njit(cache=True, nogil=True)
def _outward(matrix: np.ndarray, n: int, v: np.ndarray, new: np.ndarray) -> np.uint64:
    """Return signs that push outwards: one channel after the other, the largest effect of a greedy choice."""
    last = len(matrix) - 1
    new[:] = matrix[last]
    for j in range(n):
        for i in range(len(v)):
            new[i] += matrix[j, i] * v[j]
    signs = np.uint64(0)
    for j in range(n, last):
        along = 0.0
        for i in range(len(v)):
            along += new[i] * matrix[j, i]
        if along >= 0.0:
            signs |= np.uint64(1) << np.uint64(j)
        for i in range(len(v)):
            new[i] += matrix[j, i] if along >= 0.0 else -matrix[j, i]
    return signs


@njit(cache=True, nogil=True)
def _square(v: np.ndarray) -> float:
    total = 0.0
    for value in v:
        total += value * value
    return total


@njit(cache=True, nogil=True)
def _run(
    columns: np.ndarray, n: int, begin: np.ndarray, first: int, end: int, steps: int, seed: np.uint64, worst: np.ndarray
) -> None:
    golden = np.uint64(0x9E3779B97F4A7C15)
    r = np.uint64(len(columns))
    v, new = np.empty(len(begin)), np.empty(len(begin))
    for sequence in range(first, end):
        state = _mix(seed * golden + np.uint64(sequence + 1) * np.uint64(0xD1342543DE82EF95))
        kind = sequence % 4
        boundary = (sequence // 4) % 2
        v[:] = 0.0
        if boundary:
            for i in range(n):
                for _ in range(4):  # four uniform numbers: near enough to a normal one for a random direction
                    state += golden
                    v[i] += (_mix(state) >> np.uint64(11)) * 2.0**-53 - 0.5
            v /= np.sqrt(_square(v))
        else:
            v[:] = begin
        level = _square(v) if not boundary else 0.0
        vertex, signs, left = np.int64(0), np.uint64(0), np.int64(0)
        greedy = kind == 3 and sequence % 100 == 3
        for _ in range(steps):
            if left == 0:
                state += golden
                bits = _mix(state)
                vertex = np.int64((bits >> np.uint64(40)) % r)
                signs = bits << np.uint64(n)
                if kind == 0:
                    left = np.int64(1)
                elif kind == 1:
                    left = np.int64(steps)
                else:
                    state += golden
                    left = np.int64(1 + _mix(state) % np.uint64(200))
            left -= 1
            if greedy:
                top = -1.0
                for i in range(len(columns)):
                    choice = _outward(columns[i], n, v, new)
                    reached = _square(new)
                    if reached > top:
                        top, vertex, signs = reached, np.int64(i), choice
            elif kind == 3:
                signs = _outward(columns[vertex], n, v, new)
            _advance(columns[vertex], n, signs, v, new)
            v, new = new, v
            level = max(level, _square(v))
        worst[kind, boundary] = max(worst[kind, boundary], level)
