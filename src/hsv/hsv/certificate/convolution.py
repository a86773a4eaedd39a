"""Bounds of the tube error for flights whose altitude and velocity change at limited rates (convolution bounds).

An invariant set holds for vertices that jump from step to step. With v = e - c, v+ = A(p) v + C(p) d and abs(d_j) <= 1,
unrolling N steps about a fixed model A0, C0 gives for an output row c

    abs(c v) <= sum_{k < N} [abs(l_k C0)_1 + max_p f(l_k, [A(p) - A0, C(p) - C0])] + S(l_N),    l_k = c A0^k,
    f(l, [X, Y]) = S(l X) + abs(l Y)_1,    S(x) >= abs(x v) for all v in the certified set.

Here p = (altitude, velocity) is that of k steps before the last. At limited rates it lies near the last one, and A(p)
near the A0 of the cell of the envelope in which the last one lies. A flight of fewer than N steps starts at v = -c,
which takes the place of the last term.

A(p) is the sum of the vertices times products of weights of altitude and velocity (eq. 11). The weights are piecewise
cubic. Each piece lies in the convex hull of its Bezier points, and its derivative in that of their differences, so
that these points bound the change of A(p) for every p, not only at samples: f is convex. A box about the points, in
coordinates in which the effects of the weights on [A, C] are orthogonal, takes the place of their hull.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from hsv.core import Struct
from hsv.model.lpv.polytope import Polytope, evaluate

CELLS = 4, 12
"""Number of cells of the envelope in altitude and in velocity, which changes the model more."""

LONGEST = 1000
"""Largest number of steps N that is tried."""


def rated_bounds(
    polytope: Polytope,
    loops: np.ndarray,
    centre: np.ndarray,
    rows: np.ndarray,
    ellipsoids: Sequence[Sequence[np.ndarray]],
    changes: np.ndarray,
    horizons: Sequence[int],
) -> tuple[np.ndarray, list[int]]:
    """Return bounds (m) of the outputs |row (e - c)|, and the largest number of steps N that each of them uses.

    Args:
        polytope: Model that schedules the loops.
        loops: (r, n, n + d) closed loops [A_i, C_i], with the columns of the disturbances and of the drift.
        centre: (n) centre c of the certified set.
        rows: (m, n) outputs.
        ellipsoids: For each output, stacks (j, n, n) of ellipsoids; the sum of those of each stack contains the set.
        changes: (2) largest changes of altitude (m) and velocity (m/s) in one period.
        horizons: For each output, the largest N to try.
    """
    axes = polytope.altitude, polytope.velocity
    slopes, spans = _slopes(polytope, loops), [axis.breakpoints[[0, -1]] for axis in axes]
    roots = [[np.linalg.cholesky(stack) for stack in stacks] for stacks in ellipsoids]
    places = [low + (np.arange(n) + 0.5) * (high - low) / n for (low, high), n in zip(spans, CELLS, strict=True)]
    ages, found, used = np.arange(max(horizons)), np.zeros(len(rows)), [1] * len(rows)
    for place in product(*places):
        weights = [evaluate(axis, np.array([at]))[0] for axis, at in zip(axes, place, strict=True)]
        middle = np.tensordot(np.outer(*weights).ravel(), loops, 1)
        # Largest distance of each parameter from the centre of the cell, by age; none is beyond the envelope.
        apart = [
            np.minimum(0.5 * np.ptp(span) / n + ages * change, np.abs(span - at).max())
            for span, n, change, at in zip(spans, CELLS, changes, place, strict=True)
        ]
        for k, horizon in enumerate(horizons):
            changed = [(slope, distance[:horizon]) for slope, distance in zip(slopes, apart, strict=True)]
            bound, steps = _bound(middle, changed, centre, rows[k], roots[k], horizon)
            found[k], used[k] = max(found[k], bound), max(used[k], steps)
    return found, used


def _bound(
    middle: np.ndarray,
    changed: Sequence[tuple[np.ndarray, np.ndarray]],
    centre: np.ndarray,
    row: np.ndarray,
    roots: Sequence[np.ndarray],
    horizon: int,
) -> tuple[float, int]:
    """Return the bound of an output ``row`` for one cell, with ``middle`` = [A0, C0], and its N up to ``horizon``.

    ``changed`` has, for altitude and velocity, the matrices (g, n, n + d) that span the slopes of [A, C], and the
    distances (horizon) from the centre of the cell.
    """
    n = len(middle)
    left = np.empty((horizon + 1, n))
    left[0] = row
    for k in range(horizon):
        left[k + 1] = left[k] @ middle[:, :n]
    added = np.abs(left[:-1] @ middle[:, n:]).sum(axis=1)
    for slope, distance in changed:
        moved = np.einsum("kn,gnm->kgm", left[:-1], slope)
        added += distance * (_support(roots, moved[..., :n]) + np.abs(moved[..., n:]).sum(axis=2)).sum(axis=1)
    summed = np.append(0.0, np.cumsum(added))
    ended = summed + _support(roots, left)
    best = int(np.argmin(ended))
    started = summed[:best] + np.abs(left[:best] @ centre)
    return float(max(ended[best], started.max(initial=0.0))), best


def _support(roots: Sequence[np.ndarray], x: np.ndarray) -> np.ndarray:
    """Return S(x) for each x (..., n), from the Cholesky factors (j, n, n) of each stack of ellipsoids."""
    sums = [sum(np.sqrt(((x @ root) ** 2).sum(axis=-1)) for root in stack) for stack in roots]
    return np.asarray(np.min(sums, axis=0))


def _slopes(polytope: Polytope, loops: np.ndarray) -> list[np.ndarray]:
    """Return matrices (g, n, n + d) for altitude and for velocity: each slope of [A, C] is a sum of them.

    The factors in the sum are between -1 and 1.
    """
    size = np.abs(loops).mean(axis=0)  # entries of different units weigh alike
    shape = polytope.altitude.coefficients.shape[2], polytope.velocity.coefficients.shape[2], *loops.shape[1:]
    effects = (loops / np.where(size > 0.0, size, 1.0)).reshape(shape)
    loops = loops.reshape(shape)
    (h, h_slope), (v, v_slope) = (
        [_box(points, np.moveaxis(effects, i, 0).reshape(shape[i], -1)) for points in _bezier(axis)]
        for i, axis in enumerate((polytope.altitude, polytope.velocity))
    )
    pairs = (h_slope, v), (h, v_slope)
    return [np.einsum("ga,hb,abij->ghij", *pair, loops).reshape(-1, *shape[2:]) for pair in pairs]


def _bezier(axis: Struct) -> tuple[np.ndarray, np.ndarray]:
    """Return the Bezier points (p, r) of the weights of an axis, and those of their derivatives."""
    c3, c2, c1, c0 = axis.coefficients
    step = np.diff(axis.breakpoints)[:, None]
    points = np.stack(
        (c0, c0 + c1 * step / 3, c0 + (2 * c1 + c2 * step) * step / 3, c0 + ((c3 * step + c2) * step + c1) * step)
    )
    return points.reshape(-1, c0.shape[1]), (3 * np.diff(points, axis=0) / step).reshape(-1, c0.shape[1])


def _box(points: np.ndarray, effects: np.ndarray) -> np.ndarray:
    """Return the middle of a box that contains the ``points`` (p, r), then its half-edges, shape (1 + r, r).

    ``effects`` (r, e): what each of the r weights does. Edges lie in directions in which the points' effects differ
    most, next to most, and so on, so that directions almost without effect may be long.
    """
    mean = points.mean(axis=0)
    left, size, _ = np.linalg.svd(effects - effects.mean(axis=0), full_matrices=False)
    basis = left * np.maximum(size, 1e-9 * size[0])
    basis = basis @ np.linalg.svd((points - mean) @ basis)[2].T
    within, edges = (points - mean) @ basis, np.linalg.inv(basis)
    low, high = within.min(axis=0), within.max(axis=0)
    return np.vstack((mean + 0.5 * (low + high) @ edges, 0.5 * (high - low)[:, None] * edges))
