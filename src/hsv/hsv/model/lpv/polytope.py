"""Polytopic linear parameter-varying model (paper eq. 11, eq. 12): vertices, and weights by altitude and velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.base.errors import DesignError, one_of
from hsv.core import Struct, lib
from hsv.core.arithmetic import solve

INTERPOLATIONS = ("linear", "cubic")

BLOCK = lib.SUMS
"""Number of entries that the core sums at a time."""


def axis_weights(breakpoints: np.ndarray, samples: np.ndarray, interpolation: str) -> Struct:
    """Return the vertices' weights as functions of one scheduling variable, as an ``hsv_axis``.

    Args:
        breakpoints: Increasing values of the scheduling variable (SI), shape (s,).
        samples: Weights of the r vertices at the breakpoints, shape (s, r); rows sum to one.
        interpolation: ``"linear"`` (a grid of vertices) or ``"cubic"`` (tensor-product weights).

    Raises:
        DesignError: The shapes are wrong, the breakpoints do not increase, or the interpolation is unknown.
    """
    breakpoints = np.ascontiguousarray(breakpoints, float)
    samples = np.asarray(samples, float)
    if samples.ndim != 2 or breakpoints.shape != samples.shape[:1] or len(breakpoints) < 2:
        raise DesignError(
            f"weights of shape {samples.shape} at {breakpoints.shape} breakpoints: expected (s, r) at (s)"
        )
    if not np.all(np.diff(breakpoints) > 0.0):
        raise DesignError("breakpoints of the scheduling weights: expected increasing values")
    if interpolation == "linear":
        slope = np.diff(samples, axis=0) / np.diff(breakpoints)[:, None]
        coefficients = np.stack((np.zeros_like(slope), np.zeros_like(slope), slope, samples[:-1]))
    elif interpolation == "cubic":
        coefficients = _spline(breakpoints, samples)
    else:
        raise DesignError(f"interpolation = {interpolation!r}: expected {one_of(INTERPOLATIONS, interpolation)}")
    return Struct("hsv_axis", breakpoints=breakpoints, coefficients=np.ascontiguousarray(coefficients))


def _spline(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the coefficients, shape (4, s - 1, r), of not-a-knot cubic splines through s points, highest power first.

    Spline i has the values ``y[:, i]`` at ``x``. Two points give a line, three a parabola; with more, the third
    derivative is continuous at the second and second last point (de Boor, A Practical Guide to Splines, ch. IV).
    """
    n = len(x)
    step = np.diff(x)
    secant = np.diff(y, axis=0) / step[:, None]
    if n == 2:
        return np.stack((np.zeros_like(secant), np.zeros_like(secant), secant, y[:-1]))
    # Continuity of the second derivatives gives equations for the slopes at the inner breakpoints.
    left, right = np.zeros((n, n)), np.empty_like(y)
    for i in range(1, n - 1):
        left[i, i - 1 : i + 2] = step[i], 2.0 * (step[i - 1] + step[i]), step[i - 1]
        right[i] = 3.0 * (step[i] * secant[i - 1] + step[i - 1] * secant[i])
    if n == 3:
        left[0, :2] = left[2, 1:] = 1.0
        right[0], right[2] = 2.0 * secant[0], 2.0 * secant[1]
    else:
        for near, far, inner, end in ((0, 1, 1, 0), (n - 2, n - 3, n - 2, n - 1)):
            both = step[near] + step[far]
            left[end, inner], left[end, end] = both, step[far]
            weighted = (step[near] + 2.0 * both) * step[far] * secant[near] + step[near] * step[near] * secant[far]
            right[end] = weighted / both
    slope = solve(left, right)
    bend = (slope[:-1] + slope[1:] - 2.0 * secant) / step[:, None]
    return np.stack((bend / step[:, None], (secant - slope[:-1]) / step[:, None] - bend, slope[:-1], y[:-1]))


def evaluate(weights: Struct, values: np.ndarray) -> np.ndarray:
    """Return the weights, shape (n, r), of r vertices at n ``values`` of their variable, clamped to the breakpoints."""
    breakpoints, coefficients = weights.breakpoints, weights.coefficients
    clamped = np.clip(values, breakpoints[0], breakpoints[-1])
    piece = np.clip(np.searchsorted(breakpoints, clamped, side="right") - 1, 0, len(breakpoints) - 2)
    local = (clamped - breakpoints[piece])[:, None]
    c = coefficients[:, piece]
    return np.asarray(((c[0] * local + c[1]) * local + c[2]) * local + c[3])


@dataclass(frozen=True)
class Polytope:
    """A discrete-time polytopic model (paper eq. 12) scheduled by altitude (m) and velocity (m/s).

    The r vertices ``A`` (r, n, n) and ``B`` (r, n, m) are ordered by altitude, then velocity: if ``velocity`` has s
    weights, the weight of vertex i * s + j is weight i of ``altitude`` times weight j of ``velocity``. Altitude and
    velocity are clamped to the breakpoints.
    """

    A: np.ndarray
    B: np.ndarray
    altitude: Struct
    velocity: Struct

    def __post_init__(self) -> None:
        r = self.altitude.coefficients.shape[2] * self.velocity.coefficients.shape[2]
        n = self.A.shape[1]
        if self.A.shape != (r, n, n) or self.B.ndim != 3 or self.B.shape[:2] != (r, n):
            raise DesignError(f"vertices A {self.A.shape}, B {self.B.shape}: expected {r} matrices of matching size")

    def data(self) -> Struct:
        """Return the model as an ``hsv_polytope``, without entries that are zero at every vertex.

        The other entries of each vertex are padded with zeros to a multiple of :data:`BLOCK`.
        """
        n, m = self.B.shape[1:]
        S = np.concatenate((self.A, self.B), axis=2).reshape(len(self.A), -1)
        entries = np.flatnonzero(S.any(axis=0))
        packed = np.zeros((len(S), -(-len(entries) // BLOCK) * BLOCK))
        packed[:, : len(entries)] = S[:, entries]
        firsts = [row * (n + m) + column for row in range(n) for column in (0, n)]
        starts = np.searchsorted(entries, [*firsts, n * (n + m)])
        return Struct(
            "hsv_polytope", S=packed, entries=entries, starts=starts, altitude=self.altitude, velocity=self.velocity
        )

    def at(self, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
        """Return A (n, n) and B (n, m) at ``altitude`` (m) and ``velocity`` (m/s), clamped to the breakpoints."""
        h, v = evaluate(self.altitude, np.array([altitude])), evaluate(self.velocity, np.array([velocity]))
        A, B = np.zeros(self.A.shape[1:]), np.zeros(self.B.shape[1:])
        for weight, A_i, B_i in zip(np.outer(h, v).flat, self.A, self.B, strict=True):
            A += weight * A_i
            B += weight * B_i
        return A, B
