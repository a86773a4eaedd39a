"""The polytopic model that a design stands on, and how well it agrees with the vehicle between its samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.design.inputs import ModelInputs
from hsv.lpv.accuracy import model_accuracy, off_grid
from hsv.lpv.discretisation import zero_order_hold
from hsv.lpv.grid import grid_polytope, linearise, sample
from hsv.lpv.polytope import Polytope
from hsv.lpv.tensor_product import tensor_product
from hsv.vehicle.envelope import ALTITUDE_RANGE, VELOCITY_RANGE
from hsv.vehicle.parameters import VehicleParameters

_POINTS = 46
"""Altitudes, and velocities, at which the model is compared with the vehicle."""

_FREQUENCIES = np.logspace(-2.0, 2.0, 200)
"""rad/s, those of the paper's figure 2."""


@dataclass(frozen=True)
class DesignModel:
    """The model with its weights as a design file keeps them, and the evidence for it (ready for JSON)."""

    polytope: Polytope
    interpolation: str
    altitude_samples: tuple[np.ndarray, np.ndarray]
    velocity_samples: tuple[np.ndarray, np.ndarray]
    report: dict[str, Any]


def polytopic_model(inputs: ModelInputs, vehicle: VehicleParameters) -> DesignModel:
    """Return the polytopic model of ``vehicle``, decoupled, over the envelope, in the representation asked for.

    Raises:
        DesignError: Too few samples for the tolerance, or no hull.
    """
    scales = inputs.tensor_product.state_scale.array(), inputs.tensor_product.input_scale.array()
    singular_values: tuple[np.ndarray, ...] = ()
    if inputs.representation == "grid":
        altitudes = np.linspace(*ALTITUDE_RANGE, inputs.grid.altitude_vertices)
        velocities = np.linspace(*VELOCITY_RANGE, inputs.grid.velocity_vertices)
        polytope = grid_polytope(vehicle, altitudes, velocities, inputs.period)
        interpolation = "linear"
        altitude_samples = (altitudes, np.eye(len(altitudes)))
        velocity_samples = (velocities, np.eye(len(velocities)))
    else:
        altitudes = np.linspace(*ALTITUDE_RANGE, inputs.tensor_product.altitude_samples)
        velocities = np.linspace(*VELOCITY_RANGE, inputs.tensor_product.velocity_samples)
        samples = sample(vehicle, altitudes, velocities, inputs.period)
        product = tensor_product(*samples, altitudes, velocities, *scales, inputs.tensor_product.tolerance)
        polytope, interpolation = product.polytope, "cubic"
        altitude_samples, velocity_samples = product.altitude_samples, product.velocity_samples
        singular_values = product.singular_values
    report = {
        "representation": inputs.representation,
        "vertices": [altitude_samples[1].shape[1], velocity_samples[1].shape[1]],
        "singular_values": [values[:8].tolist() for values in singular_values],
    }
    return DesignModel(polytope, interpolation, altitude_samples, velocity_samples, report)


def design_model(inputs: ModelInputs, vehicle: VehicleParameters) -> DesignModel:
    """Return :func:`polytopic_model` with its accuracy between the samples in the report.

    Raises:
        DesignError: Too few samples for the tolerance, or no hull.
    """
    model = polytopic_model(inputs, vehicle)

    def exact(altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
        return zero_order_hold(*linearise(vehicle, altitude, velocity), inputs.period)

    accuracy = model_accuracy(
        model.polytope,
        exact,
        off_grid(*ALTITUDE_RANGE, _POINTS),
        off_grid(*VELOCITY_RANGE, _POINTS),
        inputs.tensor_product.state_scale.array(),
        inputs.tensor_product.input_scale.array(),
        _FREQUENCIES,
        inputs.period,
    )
    return replace(model, report=model.report | {"accuracy": accuracy.report()})
