"""Counter-examples: disturbance sequences that drive the error far; no certified bound can be below what they reach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.design.tube_problem import TubeProblem
from hsv.lmi.semidefinite import spectral_radii

_NEGLIGIBLE = 1e-6
"""The response of an output is cut off where one more step adds less than this share of the sum so far."""

_LONGEST = 10_000
"""Maximum length of a sequence. A longer one may drive the error farther, but the value of this one is attained."""


@dataclass(frozen=True)
class CounterExamples:
    """Range of each output row that disturbances reach from zero error, at the fixed vertex where it is widest.

    ``half_range``: half the difference of the outputs after the worst sequence and after its mirror image about the
    mid-points of W, SI; ``vertex``: index of the vertex; ``steps``: length of the sequence. One
    entry per row of :meth:`TubeProblem.output_rows`.
    """

    half_range: np.ndarray
    vertex: np.ndarray
    steps: np.ndarray

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers for JSON."""
        return {name: value.tolist() for name, value in vars(self).items()}


def counter_examples(problem: TubeProblem) -> CounterExamples:
    """Return the counter-examples of all output rows, from simulations of e(k+1) = A_i e(k) + G_i d(k) with e(0) = 0.

    At a fixed vertex i, an output of row c is c e(m) = sum_k c A_i^(m-1-k) G_i d(k). It is largest if each disturbance
    is at its upper or lower bound, by the sign of its factor. Changing vertices may reach farther; they are not tried.

    Raises:
        DesignError: A vertex is not stable: the error has no bound there.
    """
    radius = spectral_radii(problem.system.A).max()
    if not radius < 1.0:
        raise DesignError(f"counter-examples: spectral radius of a vertex = {radius:.6g}, expected below 1")
    rows = problem.output_rows()
    found = [_driven(problem, row) for row in rows]
    half_range, vertex, steps = (np.array(column) for column in zip(*found, strict=True))
    return CounterExamples(half_range, vertex, steps)


def responses(problem: TubeProblem, row: np.ndarray) -> np.ndarray:
    """Return the response (steps, r, d) of an output ``row`` (n) to unit disturbances at each vertex.

    Entry [m, i, j] is due to disturbance j at vertex i, m + 1 steps earlier. Steps with negligible responses at the
    end, and those after 10 000, are omitted. All vertices must be stable.
    """
    A, G, half_width = problem.system.A, problem.system.G, problem.disturbance.half_width
    found: list[np.ndarray] = []
    total, left = np.zeros(len(A)), np.broadcast_to(row, (len(A), len(row)))
    while len(found) < _LONGEST:
        found.append(np.einsum("in,ind->id", left, G))
        share = np.abs(found[-1]) @ half_width
        total += share
        left = np.einsum("in,inm->im", left, A)
        # The slow poles are real, so a small share is not merely the zero crossing of an oscillation.
        if len(found) % 100 == 0 and np.all(share <= _NEGLIGIBLE * total):
            break
    return np.array(found)


def _driven(problem: TubeProblem, row: np.ndarray) -> tuple[float, int, int]:
    A, G, disturbance = problem.system.A, problem.system.G, problem.disturbance
    found = responses(problem, row)
    vertex = int(np.argmax(np.abs(found).sum(axis=0) @ disturbance.half_width))
    signs = np.sign(found[::-1, vertex])
    ends = []
    for side in (1.0, -1.0):
        e = np.zeros(len(row))
        for d in disturbance.centre + side * signs * disturbance.half_width:
            e = A[vertex] @ e + G[vertex] @ d
        ends.append(float(row @ e))
    return 0.5 * (ends[0] - ends[1]), vertex, len(signs)
