"""The polytopic model of a vehicle over its envelope (paper eq. 10 to eq. 12), or with its notch filter (eq. 45)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hsv.model.lpv.accuracy import ModelAccuracy, model_accuracy, off_grid
from hsv.model.lpv.linearisation import (
    Filter,
    Linearised,
    from_true_rate,
    grid_polytope,
    linearise,
    linearise_extended,
    sample,
    zero_order_hold,
)
from hsv.model.lpv.polytope import Polytope
from hsv.model.lpv.tensor_product import tensor_product
from hsv.model.signals import N_STATES
from hsv.model.vehicle import Vehicle

_POINTS = 46
"""Altitudes, and velocities, at which the model is compared with the vehicle."""

_FREQUENCIES = np.logspace(-2.0, 2.0, 200)
"""rad/s, those of the paper's figure 2; those above the Nyquist frequency are left out."""


@dataclass(frozen=True)
class PolytopicModel:
    """The model, how it was found, and the model in continuous time that it represents.

    ``polytope``: of nine states. ``whole``: as it was found; with a filter it has the filtered pitch rate in place of
    the true one, and the filter's states after the nine. ``samples``: positions (k) and weights (k, v) of the vertices
    in altitude and in velocity, to interpolate between.
    """

    vehicle: Vehicle
    period: float
    exact: Linearised
    whole: Polytope
    polytope: Polytope
    interpolation: str
    samples: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    singular_values: Sequence[np.ndarray]

    def accuracy(self, judged: Polytope, scales: tuple[np.ndarray, np.ndarray]) -> ModelAccuracy:
        """Return the accuracy of the vertices ``judged``, between the samples; ``scales`` of states and inputs."""

        def exact(altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
            return zero_order_hold(*self.exact(altitude, velocity), self.period)

        altitudes, velocities = self.vehicle.altitude_range, self.vehicle.velocity_range
        points = off_grid(*altitudes, _POINTS), off_grid(*velocities, _POINTS)
        frequencies = _FREQUENCIES[: np.searchsorted(_FREQUENCIES, 0.99 * np.pi / self.period)]
        return model_accuracy(judged, exact, *points, *scales, frequencies, self.period)


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
        vehicle: Its inertial coupling is left out.
        notch: The filter that is a part of the model, if one is.
        period: s.
        counts: Samples in altitude and in velocity.
        scales: Sizes of states and inputs that count as equal, SI.
        tensor: Tolerance and functions of the tensor-product transformation; None: the samples are the vertices.

    Raises:
        DesignError: Too few samples for the tolerance, or no hull.
    """
    exact: Linearised = partial(linearise, vehicle.decoupled)
    if notch:
        exact = partial(linearise_extended, vehicle.decoupled, notch)
    altitudes, velocities = (
        np.linspace(*vehicle.altitude_range, counts[0]),
        np.linspace(*vehicle.velocity_range, counts[1]),
    )
    values: Sequence[np.ndarray] = ()
    if tensor is None:
        whole, interpolation = grid_polytope(exact, altitudes, velocities, period), "linear"
        samples = (altitudes, np.eye(len(altitudes))), (velocities, np.eye(len(velocities)))
    else:
        found = tensor_product(*sample(exact, altitudes, velocities, period), altitudes, velocities, *scales, *tensor)
        whole, interpolation, values = found.polytope, "cubic", found.singular_values
        samples = found.altitude_samples, found.velocity_samples
    polytope = whole
    if notch:
        # x' = T x: with the true pitch rate in the state, no state of the filter acts on the vehicle.
        T, of = from_true_rate(notch), slice(N_STATES)
        A, B = np.linalg.solve(T, whole.A @ T)[:, of, of], np.linalg.solve(T, whole.B)[:, of]
        polytope = Polytope(np.ascontiguousarray(A), np.ascontiguousarray(B), whole.altitude, whole.velocity)
    return PolytopicModel(vehicle, period, exact, whole, polytope, interpolation, samples, values)
