"""The polytopic model of a vehicle over its envelope (paper eq. 10 to eq. 12), or with its notch filter (eq. 45)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from hsv.model.lpv.linearisation import (
    Filter,
    Linearised,
    bode_difference,
    frequency_response,
    from_true_rate,
    linearise,
    linearise_extended,
    sample,
    zero_order_hold,
)
from hsv.model.lpv.polytope import Polytope, axis_weights, evaluate
from hsv.model.lpv.tensor_product import tensor_product
from hsv.model.signals import N_STATES
from hsv.model.vehicle import Vehicle

_POINTS = 46
"""Number of altitudes, and of velocities, at which the model is compared with the vehicle."""

_BODE_POINTS = 6
"""Number of altitudes, and of velocities, at which Bode plots are compared."""

_FREQUENCIES = np.logspace(-2.0, 2.0, 200)
"""Frequencies (rad/s) of the paper's figure 2; those above the Nyquist frequency are left out."""


@dataclass(frozen=True)
class PolytopicModel:
    """A polytopic model of a vehicle, and ``exact``, the continuous-time model that it approximates.

    The states of ``exact`` are the vehicle's nine; with a filter, the filtered pitch rate replaces the true one and the
    filter's states follow. ``whole`` is the discrete-time polytope with these states, ``polytope`` the one with the
    nine states and the true pitch rate; without a filter they are the same. ``samples`` has, for altitude and for
    velocity, breakpoints, shape (k,), and the v weights there, shape (k, v). ``singular_values`` are those of
    :func:`tensor_product`, or empty.
    """

    vehicle: Vehicle
    period: float
    exact: Linearised
    whole: Polytope
    polytope: Polytope
    interpolation: str
    samples: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    singular_values: Sequence[np.ndarray]

    def accuracy(self, judged: Polytope, scales: tuple[np.ndarray, np.ndarray]) -> dict[str, float]:
        """Return the largest errors of ``judged``, by name, against the discretised ``exact`` on a grid of points.

        The relative error at a point is the Frobenius norm of the difference of [A, B] divided by that of the exact
        [A - I, B], both scaled. Bode plots from all inputs to all states are compared where the relative error is
        largest and on a coarser grid. The result also has the number of points, the smallest weight, and the largest
        deviation of a sum of weights from one.

        Args:
            judged: Polytopic model with the states of ``whole``.
            scales: Scales (SI) of the states, shape (n,), and of the inputs, shape (m,).
        """

        def exact(altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
            return zero_order_hold(*self.exact(altitude, velocity), self.period)

        ranges = self.vehicle.altitude_range, self.vehicle.velocity_range
        # Midpoints of equal intervals, of which few or none are samples.
        altitudes, velocities = (
            (low + (high - low) * (np.arange(_POINTS) + 0.5) / _POINTS).tolist() for low, high in ranges
        )
        weights = evaluate(judged.altitude, np.array(altitudes)), evaluate(judged.velocity, np.array(velocities))
        n, m = (len(scale) for scale in scales)
        vertices = np.concatenate((judged.A, judged.B), axis=2)
        vertices = vertices.reshape(weights[0].shape[1], weights[1].shape[1], n, n + m)
        approximate = np.einsum("hi,vj,ijab->hvab", *weights, vertices)
        scale, identity = np.concatenate(scales) / scales[0][:, None], np.eye(n, n + m)
        largest, at = -1.0, (0.0, 0.0)
        for (i, altitude), (j, velocity) in product(enumerate(altitudes), enumerate(velocities)):
            S = np.hstack(exact(altitude, velocity))
            error = float(np.linalg.norm((approximate[i, j] - S) * scale) / np.linalg.norm((S - identity) * scale))
            if error > largest:
                largest, at = error, (altitude, velocity)
        frequencies = _FREQUENCIES[: np.searchsorted(_FREQUENCIES, 0.99 * np.pi / self.period)]
        few = np.linspace(0, _POINTS - 1, _BODE_POINTS).round().astype(int)
        magnitude = phase = 0.0
        for point in (at, *product((altitudes[i] for i in few), (velocities[i] for i in few))):
            responses = [frequency_response(*model(*point), frequencies, self.period) for model in (judged.at, exact)]
            decibel, degree = bode_difference(*responses)
            magnitude, phase = max(magnitude, float(decibel.max())), max(phase, float(degree.max()))
        return {
            "points": _POINTS * _POINTS,
            "relative_frobenius_error": largest,
            "bode_magnitude_error_db": magnitude,
            "bode_phase_error_deg": phase,
            "smallest_weight": float(min(w.min() for w in weights)),
            "weight_sum_error": float(max(np.abs(w.sum(axis=1) - 1.0).max() for w in weights)),
        }


def polytopic_model(
    vehicle: Vehicle,
    notch: Filter | None,
    period: float,
    counts: tuple[int, int],
    scales: tuple[np.ndarray, np.ndarray],
    tensor: tuple[float, str] | None = None,
) -> PolytopicModel:
    """Return the polytopic model of ``vehicle``, decoupled, over its envelope.

    Args:
        vehicle: The vehicle; its inertial coupling is ignored.
        notch: Filter that is part of the model, or None.
        period: Sampling period (s).
        counts: Numbers of samples in altitude and in velocity.
        scales: Scales (SI) of states, shape (n,), and inputs, shape (m,): errors of these sizes count as equal.
        tensor: Tolerance and functions of :func:`tensor_product`; None: the samples are the vertices.

    Raises:
        DesignError: There are too few samples, the functions are unknown, or no hull was found.
        TrimError: There is no equilibrium within the input limits at a sample.
    """
    exact: Linearised = partial(linearise, vehicle.decoupled)
    if notch:
        exact = partial(linearise_extended, vehicle.decoupled, notch)
    altitudes, velocities = (
        np.linspace(*vehicle.altitude_range, counts[0]),
        np.linspace(*vehicle.velocity_range, counts[1]),
    )
    A, B = sample(exact, altitudes, velocities, period)
    values: Sequence[np.ndarray] = ()
    if tensor is None:
        interpolation = "linear"
        samples = (altitudes, np.eye(len(altitudes))), (velocities, np.eye(len(velocities)))
        axes = [axis_weights(*own, interpolation) for own in samples]
        whole = Polytope(A.reshape(-1, *A.shape[2:]), B.reshape(-1, *B.shape[2:]), *axes)
    else:
        interpolation = "cubic"
        whole, samples, values = tensor_product(A, B, altitudes, velocities, *scales, *tensor)
    polytope = whole
    if notch:
        # x' = T x: with the true pitch rate in the state, no state of the filter acts on the vehicle.
        T, of = from_true_rate(notch), slice(N_STATES)
        A, B = np.linalg.solve(T, whole.A @ T)[:, of, of], np.linalg.solve(T, whole.B)[:, of]
        polytope = Polytope(np.ascontiguousarray(A), np.ascontiguousarray(B), whole.altitude, whole.velocity)
    return PolytopicModel(vehicle, period, exact, whole, polytope, interpolation, samples, values)
