"""Accuracy of a polytopic model, compared with the original model between its samples (paper fig. 2 and 8)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from hsv.model.lpv.linearisation import bode_difference, frequency_response
from hsv.model.lpv.polytope import Polytope, evaluate

Model = Callable[[float, float], tuple[np.ndarray, np.ndarray]]
"""Discrete-time A (n, n) and B (n, m) at an altitude (m) and a velocity (m/s)."""

_BODE_POINTS = 6
"""Number of altitudes, and of velocities, at which Bode plots are compared."""


@dataclass(frozen=True)
class ModelAccuracy:
    """Largest deviations of a polytopic model over a number of ``points``.

    ``frobenius`` is the error of the scaled [A - I, B], relative to its Frobenius norm; ``magnitude`` (n, m; dB) and
    ``phase`` (n, m; deg) are those of the Bode plots of all states to all inputs. ``smallest_weight`` is the smallest
    weight of a vertex, ``weight_sum`` the largest difference of a sum of weights from 1.
    """

    points: int
    frobenius: float
    magnitude: np.ndarray
    phase: np.ndarray
    smallest_weight: float
    weight_sum: float

    def report(self) -> dict[str, float]:
        """Return the deviations for JSON, with the largest values over all Bode plots."""
        return {
            "points": self.points,
            "relative_frobenius_error": self.frobenius,
            "bode_magnitude_error_db": float(self.magnitude.max()),
            "bode_phase_error_deg": float(self.phase.max()),
            "smallest_weight": self.smallest_weight,
            "weight_sum_error": self.weight_sum,
        }


def off_grid(low: float, high: float, points: int) -> np.ndarray:
    """Return ``points`` equidistant values inside the interval from ``low`` to ``high``, without its ends."""
    return low + (high - low) * (np.arange(points) + 0.5) / points


def _few(values: np.ndarray) -> list[float]:
    kept: list[float] = values[np.unique(np.linspace(0, len(values) - 1, _BODE_POINTS).round().astype(int))].tolist()
    return kept


def model_accuracy(
    polytope: Polytope,
    model: Model,
    altitudes: np.ndarray,
    velocities: np.ndarray,
    state_scale: np.ndarray,
    input_scale: np.ndarray,
    frequencies: np.ndarray,
    period: float,
) -> ModelAccuracy:
    """Return the largest deviations of ``polytope`` from ``model`` on all combinations of altitude and velocity.

    Bode plots of all states to all inputs are compared at the point of the largest Frobenius error, and at the
    combinations of about six altitudes and six velocities, the outermost included.

    Args:
        polytope: Polytopic model.
        model: Original model that ``polytope`` represents.
        altitudes: (a) m, off the samples.
        velocities: (b) m/s, off the samples.
        state_scale: (n) scales of the states, SI.
        input_scale: (m) scales of the inputs, SI.
        frequencies: (f) rad/s, below the Nyquist frequency.
        period: Sampling period (s) of both models.
    """
    n, m = len(state_scale), len(input_scale)
    columns = np.concatenate((state_scale, input_scale))
    identity = np.eye(n, n + m)
    h_weights, v_weights = evaluate(polytope.altitude, altitudes), evaluate(polytope.velocity, velocities)
    vertices = np.concatenate((polytope.A, polytope.B), axis=2)
    vertices = vertices.reshape(h_weights.shape[1], v_weights.shape[1], n, n + m)
    approximate = np.einsum("hi,vj,ijab->hvab", h_weights, v_weights, vertices)
    worst, worst_point = -1.0, (0.0, 0.0)
    for (i, altitude), (j, velocity) in product(enumerate(altitudes.tolist()), enumerate(velocities.tolist())):
        exact = np.hstack(model(altitude, velocity))
        scale = columns / state_scale[:, None]
        error = float(np.linalg.norm((approximate[i, j] - exact) * scale) / np.linalg.norm((exact - identity) * scale))
        if error > worst:
            worst, worst_point = error, (altitude, velocity)
    magnitude, phase = np.zeros((n, m)), np.zeros((n, m))
    for point in (worst_point, *product(_few(altitudes), _few(velocities))):
        decibel, degree = bode_difference(
            frequency_response(*polytope.at(*point), frequencies, period),
            frequency_response(*model(*point), frequencies, period),
        )
        magnitude, phase = np.maximum(magnitude, decibel.max(axis=0)), np.maximum(phase, degree.max(axis=0))
    return ModelAccuracy(
        points=len(altitudes) * len(velocities),
        frobenius=worst,
        magnitude=magnitude,
        phase=phase,
        smallest_weight=float(min(h_weights.min(), v_weights.min())),
        weight_sum=float(max(np.abs(w.sum(axis=1) - 1.0).max() for w in (h_weights, v_weights))),
    )
