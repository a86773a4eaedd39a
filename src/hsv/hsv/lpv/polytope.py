"""Polytopic linear parameter-varying model (paper eq. 11, eq. 12): vertices, weights over altitude and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.elimination import solve
from hsv.errors import DesignError
from hsv.lanes import BLOCK, choose, lanes_in, least, most

INTERPOLATIONS = ("linear", "cubic")


class AxisWeights(NamedTuple):
    """Weights of the vertices along one scheduling variable, as a piecewise polynomial; for compiled functions.

    ``breakpoints`` (s), ``coefficients`` (4, s - 1, r): power 3 first, local to each piece, one column per vertex.
    """

    breakpoints: np.ndarray
    coefficients: np.ndarray


def axis_weights(breakpoints: np.ndarray, samples: np.ndarray, interpolation: str) -> AxisWeights:
    """Return the interpolated weights of one scheduling variable.

    Args:
        breakpoints: (s) increasing values of the scheduling variable, SI.
        samples: (s, r) weights of the r vertices there; rows sum to one.
        interpolation: ``"linear"`` (a grid of vertices) or ``"cubic"`` (tensor-product weights).

    Raises:
        DesignError: Wrong shapes, breakpoints that do not increase, or an unknown interpolation.
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
        raise DesignError(f"interpolation = {interpolation!r}: expected one of {', '.join(INTERPOLATIONS)}")
    return AxisWeights(breakpoints, np.ascontiguousarray(coefficients))


def _spline(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the coefficients (4, s - 1, r) of the cubic splines through ``y`` (s, r) at ``x`` (s), not-a-knot.

    Two points give a line, three a parabola, four and more piecewise cubics with a continuous third derivative at the
    second and at the last point but one (de Boor, A Practical Guide to Splines, ch. IV).
    """
    n = len(x)
    step = np.diff(x)
    secant = np.diff(y, axis=0) / step[:, None]
    if n == 2:
        return np.stack((np.zeros_like(secant), np.zeros_like(secant), secant, y[:-1]))
    # The slopes at the breakpoints: second derivatives are continuous inside.
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


def evaluate(weights: AxisWeights, values: np.ndarray) -> np.ndarray:
    """Return the weights (n, r) at many ``values`` (n), clamped to the breakpoints; for design and plots."""
    breakpoints, coefficients = weights
    clamped = np.clip(values, breakpoints[0], breakpoints[-1])
    piece = np.clip(np.searchsorted(breakpoints, clamped, side="right") - 1, 0, len(breakpoints) - 2)
    local = (clamped - breakpoints[piece])[:, None]
    c = coefficients[:, piece]
    return np.asarray(((c[0] * local + c[1]) * local + c[2]) * local + c[3])


class PolytopeData(NamedTuple):
    """A polytopic model as compiled functions take it.

    ``S`` (r, e) holds what is not zero in all vertices of [A_i, B_i] row by row, then zeros up to a multiple of
    :data:`hsv.lanes.BLOCK`. ``entries``: the places of these numbers in the flattened [A_i, B_i] (n (n + m)).
    ``starts`` (2 n + 1): where those of the rows of A and of B begin, in turn.
    """

    S: np.ndarray
    entries: np.ndarray
    starts: np.ndarray
    altitude: AxisWeights
    velocity: AxisWeights


@dataclass(frozen=True)
class Polytope:
    """A discrete-time polytopic model (paper eq. 12).

    ``A`` (r, n, n), ``B`` (r, n, m), altitude-major: vertex i * r_velocity + j. Scheduling variables are altitude (m)
    and velocity (m/s); outside the breakpoints they are clamped.
    """

    A: np.ndarray
    B: np.ndarray
    altitude: AxisWeights
    velocity: AxisWeights

    def __post_init__(self) -> None:
        r = self.altitude.coefficients.shape[2] * self.velocity.coefficients.shape[2]
        n = self.A.shape[1]
        if self.A.shape != (r, n, n) or self.B.ndim != 3 or self.B.shape[:2] != (r, n):
            raise DesignError(f"vertices A {self.A.shape}, B {self.B.shape}: expected {r} matrices of matching size")

    def data(self) -> PolytopeData:
        """Return the form that compiled functions take."""
        n, m = self.B.shape[1:]
        S = np.concatenate((self.A, self.B), axis=2).reshape(len(self.A), -1)
        entries = np.flatnonzero(S.any(axis=0))
        packed = np.zeros((len(S), -(-len(entries) // BLOCK) * BLOCK))
        packed[:, : len(entries)] = S[:, entries]
        firsts = [row * (n + m) + column for row in range(n) for column in (0, n)]
        starts = np.searchsorted(entries, [*firsts, n * (n + m)])
        return PolytopeData(packed, entries, starts, self.altitude, self.velocity)

    def at(self, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
        """Return A (n, n) and B (n, m) at ``altitude`` (m) and ``velocity`` (m/s)."""
        n, m = self.B.shape[1:]
        S = np.empty(n * (n + m))
        schedule(self.data(), altitude, velocity, np.empty(len(self.A)), S)
        S = S.reshape(n, n + m)
        return S[:, :n], S[:, n:]


@njit_in_flight(inline="always")
def _clamp(value: Any, low: float, high: float) -> Any:
    # Written so that a NaN (a diverged flight) becomes ``low`` and never an index.
    return choose(value > low, choose(value > high, high, value), low)


@njit_in_flight(inline="always")
def _piece(breakpoints: np.ndarray, value: float) -> int:
    i = 0
    while i < len(breakpoints) - 2 and value >= breakpoints[i + 1]:
        i += 1
    return i


@njit_in_flight(inline="always")
def _pieces(breakpoints: np.ndarray, value: Any) -> tuple[int, int]:
    """Return the pieces of the least lane and of the largest."""
    first = _piece(breakpoints, least(value))
    return first, first if lanes_in(value) == 1 else _piece(breakpoints, most(value))


@njit_in_flight(inline="always")
def _cubic(axis: Any, piece: int, value: Any, vertex: int) -> Any:
    c = axis.coefficients
    local = value - axis.breakpoints[piece]
    return ((c[0, piece, vertex] * local + c[1, piece, vertex]) * local + c[2, piece, vertex]) * local + c[
        3, piece, vertex
    ]


@njit_in_flight(inline="always")
def _weight(axis: Any, first: int, last: int, value: Any, vertex: int) -> Any:
    """Return the weight of a vertex; ``first`` and ``last``: see :func:`_pieces`."""
    weight = _cubic(axis, first, value, vertex)
    for piece in range(first + 1, last + 1):
        weight = choose(value >= axis.breakpoints[piece], _cubic(axis, piece, value, vertex), weight)
    return weight


@njit_in_flight(inline="always")
def vertex_weights(polytope: Any, altitude: Any, velocity: Any, weights: Any) -> Any:
    """Write the ``weights`` (r) of the vertices (paper eq. 11); tell whether p lay inside the envelope."""
    h_axis, v_axis = polytope.altitude, polytope.velocity
    h = _clamp(altitude, h_axis.breakpoints[0], h_axis.breakpoints[-1])
    v = _clamp(velocity, v_axis.breakpoints[0], v_axis.breakpoints[-1])
    h_first, h_last = _pieces(h_axis.breakpoints, h)
    v_first, v_last = _pieces(v_axis.breakpoints, v)
    n_h = h_axis.coefficients.shape[2]
    n_v = v_axis.coefficients.shape[2]
    # Those along the velocity stand in the first places until these are multiplied, last of all.
    for j in range(n_v):
        weights[j] = _weight(v_axis, v_first, v_last, v, j)
    for i in range(n_h - 1, -1, -1):
        h_weight = _weight(h_axis, h_first, h_last, h, i)
        for j in range(n_v):
            weights[i * n_v + j] = h_weight * weights[j]
    return (h == altitude) & (v == velocity)


@njit_in_flight()
def schedule(polytope: Any, altitude: Any, velocity: Any, weights: Any, S: Any) -> Any:
    """Write [A(p), B(p)] (paper eq. 11), flattened, into ``S`` (n (n + m)); tell whether p lay inside the envelope.

    ``weights`` (r): scratch.
    """
    inside = vertex_weights(polytope, altitude, velocity, weights)
    for e in range(len(S)):
        S[e] = 0.0
    for e in range(len(polytope.entries)):
        total = 0.0
        for r in range(len(weights)):
            total += weights[r] * polytope.S[r, e]
        S[polytope.entries[e]] = total
    return inside
