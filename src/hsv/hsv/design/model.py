"""The polytopic model of a design (paper eq. 10 to eq. 12, eq. 45) and its accuracy between the samples.

The decoupled vehicle is linearised at its trims over p = (altitude, velocity) and discretised with held inputs. The
model is a convex combination of vertices:

    x(k+1) = A(p) x(k) + B(p) u(k),   [A(p), B(p)] = sum_i w_i(p) [A_i, B_i],   w_i >= 0, sum_i w_i = 1       (11), (12)

Each weight is a product of a weight in altitude and one in velocity. (45) is the model of the vehicle with its filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.design.inputs import ModelInputs
from hsv.lmi.semidefinite import VERTEX_DIGITS, rounded_to_size
from hsv.model.lpv import polytopic
from hsv.model.lpv.linearisation import Filter
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_STATES
from hsv.model.vehicle import Vehicle


@dataclass(frozen=True)
class DesignModel:
    """The polytopic model of a design as computed (``found``), and a ``report`` on it, ready for JSON.

    ``polytope``: the rounded vertices of the design file, for the nine states of the vehicle. ``whole``: for the DM,
    ``polytope``; for the ECM, unrounded, with the filtered pitch rate in place of the true one, then filter states.
    """

    found: polytopic.PolytopicModel
    polytope: Polytope
    whole: Polytope
    report: dict[str, Any]


def state_scale(inputs: ModelInputs, notch: Sequence[NotchSection]) -> np.ndarray:
    """Return the scales (n) of the states of the model, SI: the nine states' and, for the ECM, the filter states'.

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
    """Return the polytopic model of the decoupled ``vehicle`` over its envelope (paper eq. 12, eq. 45).

    Args:
        inputs: Inputs of the model.
        vehicle: The vehicle; its inertial coupling is ignored.
        notch: Sections of the notch filter; used for the ECM only.

    Raises:
        DesignError: Too few samples for the tolerance, no convex hull of the weights, or missing scales.
        TrimError: The vehicle cannot be trimmed at a sample.
    """
    grid, options, extended = inputs.grid, inputs.tensor_product, inputs.system == "ECM"
    scales = state_scale(inputs, notch), options.input_scale.array()
    counts, tensor = (options.altitude_samples, options.velocity_samples), (options.tolerance, options.functions)
    of_grid = inputs.representation == "grid"
    if of_grid:
        if grid is None:
            raise DesignError("model.grid: missing, expected the numbers of vertices of the grid")
        counts = grid.altitude_vertices, grid.velocity_vertices
    filter_ = Filter(*series(continuous(notch))) if extended else None
    found = polytopic.polytopic_model(vehicle, filter_, inputs.period, counts, scales, None if of_grid else tensor)
    report = {
        "representation": inputs.representation,
        "vertices": [weights.shape[1] for _, weights in found.samples],
        "singular_values": [values[:8].tolist() for values in found.singular_values],
    }
    polytope = _rounded_polytope(found.polytope, scales[0][:N_STATES], scales[1])
    return DesignModel(found, polytope, found.whole if extended else polytope, report)


def design_model(inputs: ModelInputs, vehicle: Vehicle, notch: Sequence[NotchSection] = ()) -> DesignModel:
    """Return the result of :func:`polytopic_model`, with the accuracy between the samples added to the report."""
    model = polytopic_model(inputs, vehicle, notch)
    scales = state_scale(inputs, notch), inputs.tensor_product.input_scale.array()
    return replace(model, report=model.report | {"accuracy": model.found.accuracy(model.whole, scales)})


def _rounded_polytope(polytope: Polytope, state_scale: np.ndarray, input_scale: np.ndarray) -> Polytope:
    """Return ``polytope`` rounded to :data:`VERTEX_DIGITS` digits relative to the scales; rounding noise becomes 0."""
    A = rounded_to_size(polytope.A, state_scale[:, None] / state_scale, VERTEX_DIGITS)
    B = rounded_to_size(polytope.B, state_scale[:, None] / input_scale, VERTEX_DIGITS)
    return Polytope(A, B, polytope.altitude, polytope.velocity)
