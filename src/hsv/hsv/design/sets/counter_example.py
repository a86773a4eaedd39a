"""Counter-examples: vertices and disturbances that drive the error far; no certified bound is below what they reach."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.design.tube_problem import TubeProblem
from hsv.lmi.semidefinite import spectral_radii

_NEGLIGIBLE = 1e-6
"""A sequence is long enough if, at each fixed vertex, one more step adds less than this share to what it reaches."""

_LONGEST = 10_000
"""Maximum length of a sequence. A longer one may drive the error farther, but the value of this one is attained."""

_STARTS, _SWEEPS = 32, 20
"""Number of sequences that are improved (at least one per vertex), and the most sweeps that improve them."""


@dataclass(frozen=True)
class CounterExamples:
    """The range of each output row that the worst sequence found reaches from zero error.

    ``half_range`` (7): half the difference of the outputs after the worst disturbances and after their mirror images
    about the mid-points of W, SI. ``sequences``: the vertices of each, as pairs of vertex and number of steps, first
    step first. The rows are those of :meth:`TubeProblem.output_rows`.
    """

    half_range: np.ndarray
    sequences: list[list[list[int]]]

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers for JSON."""
        return {"half_range": self.half_range.tolist(), "sequences": self.sequences}


def counter_examples(problem: TubeProblem) -> CounterExamples:
    """Return the counter-examples of all output rows.

    Raises:
        DesignError: A vertex is not stable: the error has no bound there.
    """
    A, columns = problem.system.A, problem.system.G * problem.disturbance.half_width
    radius = spectral_radii(A).max()
    if not radius < 1.0:
        raise DesignError(f"counter-examples: spectral radius of a vertex = {radius:.6g}, expected below 1")
    found = [worst_sequence(A, columns, row) for row in problem.output_rows()]
    runs = [[[vertex, len(list(run))] for vertex, run in groupby(vertices.tolist())] for _, vertices in found]
    return CounterExamples(np.array([reached for reached, _ in found]), runs)


def worst_sequence(A: np.ndarray, columns: np.ndarray, row: np.ndarray, seed: int = 1) -> tuple[float, np.ndarray]:
    """Return what an output ``row`` (n) of v+ = A_i v + g_i d reaches from v = 0 with |d_j| <= 1, and the vertices (m).

    The vertices i(k) and disturbances d(k) are improved one step at a time, the others unchanged, until no step
    improves any more. With l(k + 1) the response of the output to v(k + 1), the best choice for step k makes
    l(k + 1) (A_i v(k) + g_i d) largest. A sweep goes back from the last step: it updates l and needs only those v
    that it has not changed yet. The first sequences stay at one vertex each, the others change vertices at random.

    Args:
        A: (r, n, n) closed loops.
        columns: (r, n, d) columns g_i of the disturbances.
        row: (n) output.
        seed: Seed of the random sequences.
    """
    r, n, _ = A.shape
    stacked = np.concatenate((A, columns), axis=2).transpose(1, 0, 2).reshape(n, -1)
    vertices = _starts(r, _length(A, columns, row), seed)
    m, s = vertices.shape
    each, errors, reached = np.arange(s), np.zeros((m + 1, s, n)), np.zeros(s)
    signs = np.zeros((m, s, columns.shape[2]))
    for sweep in range(_SWEEPS):
        before, reached, left = reached, np.zeros(s), np.tile(row, (s, 1))
        for k in reversed(range(m)):
            onward = (left @ stacked).reshape(s, r, -1)
            driven = np.abs(onward[:, :, n:]).sum(axis=2)
            if sweep:  # the first only finds the disturbances of the given vertices
                gain = driven + np.einsum("srn,sn->sr", onward[:, :, :n], errors[k])
                best = gain.argmax(axis=1)
                vertices[k] = np.where(gain[each, best] > gain[each, vertices[k]], best, vertices[k])
            reached += driven[each, vertices[k]]
            left, signs[k] = onward[each, vertices[k], :n], np.sign(onward[each, vertices[k], n:])
        if np.all(reached <= before * (1.0 + _NEGLIGIBLE)):
            break
        for k, (at, d) in enumerate(zip(vertices, signs, strict=True)):
            errors[k + 1] = np.einsum("snm,sm->sn", A[at], errors[k]) + np.einsum("snd,sd->sn", columns[at], d)
    worst = int(reached.argmax())
    return float(reached[worst]), vertices[:, worst]


def _length(A: np.ndarray, columns: np.ndarray, row: np.ndarray) -> int:
    """Return the steps (in hundreds) after which disturbances at each fixed vertex have a negligible effect."""
    total, left = np.zeros(len(A)), np.tile(row, (len(A), 1))
    for steps in range(1, _LONGEST + 1):
        share = np.abs(np.einsum("in,ind->id", left, columns)).sum(axis=1)
        total, left = total + share, np.einsum("in,inm->im", left, A)
        # The slow poles are real, so a small share is not merely the zero crossing of an oscillation.
        if steps % 100 == 0 and np.all(share <= _NEGLIGIBLE * total):
            break
    return steps


def _starts(r: int, steps: int, seed: int) -> np.ndarray:
    """Return sequences of vertices (steps, s): one constant at each of r vertices, the others changed at random."""
    draw, found = np.random.default_rng(seed), [np.full(steps, vertex) for vertex in range(r)]
    while len(found) < _STARTS:
        hold = int(draw.integers(20, 400))
        found.append(np.repeat(draw.integers(r, size=steps // hold + 1), hold)[:steps])
    return np.array(found).T
