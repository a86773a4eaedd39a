"""The shipped designs with their certificates, and two models that the paper compares at one point of the envelope."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hsv.base.units import FOOT
from hsv.control.design import ControlDesign, TubeSet
from hsv.control.design_file import certificate_path, find_design, read_certificate, read_design
from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.design.inputs import DesignInputs, find_inputs, read_inputs
from hsv.design.model import polytopic_model
from hsv.model.lpv.linearisation import Filter, extended_jacobian, extended_state, zero_order_hold
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

BETWEEN = (85817.0 * FOOT, 8037.0 * FOOT)
"""Altitude (m) and velocity (m/s) of Figures 2 and 8, a point between the samples of the polytopic models."""

CODESIGN_FREQUENCIES = np.logspace(-2.0, 2.0, 1500)
"""Frequencies (rad/s) at which the co-designed model is compared."""


@cache
def design(name: str) -> ControlDesign:
    """Return a shipped design by name."""
    return read_design(find_design(name))


@cache
def certificate(name: str) -> dict[str, Any]:
    """Return the certificate of a shipped design."""
    return read_certificate(certificate_path(find_design(name)))


def tube_of(name: str) -> TubeSet:
    """Return the invariant set of a shipped design, which must have one."""
    found = design(name).tube
    assert found is not None
    return found


def inputs_of(name: str) -> DesignInputs:
    """Return the inputs of a shipped design."""
    return read_inputs(find_inputs(name))


def extended_model(inputs: DesignInputs, coupling: str | float) -> tuple[np.ndarray, np.ndarray]:
    """Return discrete A (11, 11) and B (11, 2) of the extended coupled model (paper eq. 40) at :data:`BETWEEN`.

    ``coupling`` names a set of coupling coefficients, or is a factor on the set ``derived``.
    """
    vehicle, filter_ = load_vehicle().coupled(coupling), Filter(*series(continuous(_sections(inputs))))
    equilibrium = trim(vehicle, *BETWEEN)
    state = extended_state(equilibrium.state, filter_)
    return zero_order_hold(*extended_jacobian(state, equilibrium.input, vehicle, filter_, False), inputs.model.period)


def codesigned_model(inputs: DesignInputs) -> tuple[np.ndarray, np.ndarray]:
    """Return discrete A (11, 11) and B (11, 2) of the co-designed polytopic model at :data:`BETWEEN`."""
    return polytopic_model(inputs.model, load_vehicle(), _sections(inputs)).whole.at(*BETWEEN)


def _sections(inputs: DesignInputs) -> tuple[NotchSection, ...]:
    return tuple(NotchSection(**section.model_dump()) for section in inputs.notch)
