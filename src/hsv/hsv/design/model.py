"""The polytopic model of a design (paper eq. 10 to eq. 12, eq. 45) and its accuracy between the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.control.optimisation import VERTEX_DIGITS, rounded
from hsv.design.inputs import ModelInputs
from hsv.model.lpv.accuracy import model_accuracy, off_grid
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
class DesignModel:
    """The model with its weights as a design file keeps them, and the evidence for it (ready for JSON).

    ``polytope``: nine states, as it flies. ``whole``: as it was found; for the ECM with the filtered pitch rate in
    place of the true one, and the filter's states after the nine.
    """

    polytope: Polytope
    whole: Polytope
    interpolation: str
    altitude_samples: tuple[np.ndarray, np.ndarray]
    velocity_samples: tuple[np.ndarray, np.ndarray]
    report: dict[str, Any]


def linearised(inputs: ModelInputs, vehicle: Vehicle, notch: Sequence[NotchSection]) -> Linearised:
    """Return the continuous-time model that ``inputs`` ask for, as a function of altitude (m) and velocity (m/s)."""
    if inputs.system == "DM":
        return partial(linearise, vehicle.decoupled)
    return partial(linearise_extended, vehicle.decoupled, Filter(*series(continuous(notch))))


def state_scale(inputs: ModelInputs, notch: Sequence[NotchSection]) -> np.ndarray:
    """Return the sizes (n) of the model's states that count as equal, SI.

    Raises:
        DesignError: The scales of the filter are missing.
    """
    sizes = inputs.tensor_product
    if inputs.system == "DM":
        return sizes.state_scale.array()
    if sizes.filter_scale is None:
        raise DesignError("model.tensor_product.filter_scale: missing, expected the sizes of the notch filter's states")
    return np.concatenate((sizes.state_scale.array(), *[sizes.filter_scale.array()] * len(notch)))


def polytopic_model(inputs: ModelInputs, vehicle: Vehicle, notch: Sequence[NotchSection] = ()) -> DesignModel:
    """Return the polytopic model of ``vehicle``, decoupled, over the envelope (paper eq. 12, eq. 45).

    Args:
        inputs: Inputs of the model.
        vehicle: Its inertial coupling is left out.
        notch: The filter that is a part of the ECM.

    Raises:
        DesignError: Too few samples for the tolerance, no hull, or scales that are missing.
    """
    model = linearised(inputs, vehicle, notch)
    scales = state_scale(inputs, notch), inputs.tensor_product.input_scale.array()
    singular_values: tuple[np.ndarray, ...] = ()
    if inputs.representation == "grid":
        altitudes = np.linspace(*vehicle.altitude_range, inputs.grid.altitude_vertices)
        velocities = np.linspace(*vehicle.velocity_range, inputs.grid.velocity_vertices)
        whole = grid_polytope(model, altitudes, velocities, inputs.period)
        interpolation = "linear"
        altitude_samples = (altitudes, np.eye(len(altitudes)))
        velocity_samples = (velocities, np.eye(len(velocities)))
    else:
        options = inputs.tensor_product
        altitudes = np.linspace(*vehicle.altitude_range, options.altitude_samples)
        velocities = np.linspace(*vehicle.velocity_range, options.velocity_samples)
        samples = sample(model, altitudes, velocities, inputs.period)
        product = tensor_product(*samples, altitudes, velocities, *scales, options.tolerance, options.functions)
        whole, interpolation = product.polytope, "cubic"
        altitude_samples, velocity_samples = product.altitude_samples, product.velocity_samples
        singular_values = product.singular_values
    report = {
        "representation": inputs.representation,
        "vertices": [altitude_samples[1].shape[1], velocity_samples[1].shape[1]],
        "singular_values": [values[:8].tolist() for values in singular_values],
    }
    polytope = whole if inputs.system == "DM" else _vehicle(whole, Filter(*series(continuous(notch))))
    polytope = _rounded(polytope, scales[0][:N_STATES], scales[1])
    if inputs.system == "DM":
        whole = polytope
    return DesignModel(polytope, whole, interpolation, altitude_samples, velocity_samples, report)


def design_model(inputs: ModelInputs, vehicle: Vehicle, notch: Sequence[NotchSection] = ()) -> DesignModel:
    """Return :func:`polytopic_model` with its accuracy between the samples in the report."""
    model = polytopic_model(inputs, vehicle, notch)
    continuous_model = linearised(inputs, vehicle, notch)

    def exact(altitude: float, velocity: float) -> tuple[np.ndarray, np.ndarray]:
        return zero_order_hold(*continuous_model(altitude, velocity), inputs.period)

    accuracy = model_accuracy(
        model.whole,
        exact,
        off_grid(*vehicle.altitude_range, _POINTS),
        off_grid(*vehicle.velocity_range, _POINTS),
        state_scale(inputs, notch),
        inputs.tensor_product.input_scale.array(),
        _FREQUENCIES[: np.searchsorted(_FREQUENCIES, 0.99 * np.pi / inputs.period)],
        inputs.period,
    )
    return replace(model, report=model.report | {"accuracy": accuracy.report()})


def _rounded(polytope: Polytope, state_scale: np.ndarray, input_scale: np.ndarray) -> Polytope:
    """Return the vertices rounded to the digits on which processors agree; rounding noise becomes zero."""
    A = rounded(polytope.A, state_scale[:, None] / state_scale, VERTEX_DIGITS)
    B = rounded(polytope.B, state_scale[:, None] / input_scale, VERTEX_DIGITS)
    return Polytope(A, B, polytope.altitude, polytope.velocity)


def _vehicle(whole: Polytope, notch: Filter) -> Polytope:
    """Return the vehicle's part of the polytopic ECM: with the true pitch rate, no filter state acts on it."""
    T = from_true_rate(notch)
    A, B = np.linalg.solve(T, whole.A @ T), np.linalg.solve(T, whole.B)
    vehicle = slice(N_STATES)
    return Polytope(
        np.ascontiguousarray(A[:, vehicle, vehicle]),
        np.ascontiguousarray(B[:, vehicle]),
        whole.altitude,
        whole.velocity,
    )
