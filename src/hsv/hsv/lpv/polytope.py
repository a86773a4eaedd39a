"""Polytopic linear parameter-varying model (paper eq. 11-12): vertices and their weights over altitude and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from hsv.errors import DesignError

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
        from scipy.interpolate import CubicSpline  # half a second of imports that a grid does not need

        coefficients = CubicSpline(breakpoints, samples).c
    else:
        raise DesignError(f"interpolation = {interpolation!r}: expected one of {', '.join(INTERPOLATIONS)}")
    return AxisWeights(breakpoints, np.ascontiguousarray(coefficients))


def evaluate(weights: AxisWeights, values: np.ndarray) -> np.ndarray:
    """Return the weights (n, r) at many ``values`` (n), clamped to the breakpoints; for design and plots."""
    from scipy.interpolate import PPoly

    clamped = np.clip(values, weights.breakpoints[0], weights.breakpoints[-1])
    return np.asarray(PPoly(weights.coefficients, weights.breakpoints)(clamped))


class PolytopeData(NamedTuple):
    """A polytopic model as compiled functions take it: ``S`` (r, n * (n + m)) holds [A_i, B_i] row by row."""

    S: np.ndarray
    altitude: AxisWeights
    velocity: AxisWeights


@dataclass(frozen=True)
class Polytope:
    """A discrete-time polytopic model.

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
        S = np.concatenate((self.A, self.B), axis=2).reshape(len(self.A), -1)
        return PolytopeData(np.ascontiguousarray(S), self.altitude, self.velocity)

    def at(self, altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
        """Return A (n, n) and B (n, m) at ``altitude`` (m) and ``velocity`` (m/s)."""
        n, m = self.B.shape[1:]
        S = np.empty(n * (n + m))
        schedule(self.data(), altitude, velocity, S)
        S = S.reshape(n, n + m)
        return S[:, :n], S[:, n:]


@njit(cache=True)
def _clamp(value: float, low: float, high: float) -> float:
    # Written so that a NaN (a diverged flight) becomes ``low`` and never an index.
    if not value > low:
        return low
    return high if value > high else value


@njit(cache=True)
def _piece(breakpoints: np.ndarray, value: float) -> int:
    i = 0
    while i < len(breakpoints) - 2 and value >= breakpoints[i + 1]:
        i += 1
    return i


@njit(cache=True)
def _weight(axis: Any, piece: int, local: float, vertex: int) -> float:
    c = axis.coefficients
    return ((c[0, piece, vertex] * local + c[1, piece, vertex]) * local + c[2, piece, vertex]) * local + c[
        3, piece, vertex
    ]


@njit(cache=True)
def schedule(polytope: Any, altitude: float, velocity: float, S: np.ndarray) -> bool:
    """Write [A(p), B(p)] (paper eq. 11), flattened, into ``S`` (n (n + m)); tell whether p lay inside the envelope."""
    h_axis, v_axis = polytope.altitude, polytope.velocity
    h = _clamp(altitude, h_axis.breakpoints[0], h_axis.breakpoints[-1])
    v = _clamp(velocity, v_axis.breakpoints[0], v_axis.breakpoints[-1])
    h_piece = _piece(h_axis.breakpoints, h)
    v_piece = _piece(v_axis.breakpoints, v)
    h_local = h - h_axis.breakpoints[h_piece]
    v_local = v - v_axis.breakpoints[v_piece]
    n_h = h_axis.coefficients.shape[2]
    n_v = v_axis.coefficients.shape[2]
    S[:] = 0.0
    for i in range(n_h):
        h_weight = _weight(h_axis, h_piece, h_local, i)
        for j in range(n_v):
            weight = h_weight * _weight(v_axis, v_piece, v_local, j)
            vertex = polytope.S[i * n_v + j]
            for e in range(len(S)):
                S[e] += weight * vertex[e]
    return h == altitude and v == velocity
