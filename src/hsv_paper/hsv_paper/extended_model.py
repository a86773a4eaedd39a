"""The ECM (paper eq. 40) and the co-designed polytopic model at one point, discrete, to be compared."""

from __future__ import annotations

import numpy as np

from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.design.inputs import DesignInputs
from hsv.design.model import polytopic_model
from hsv.model.lpv.linearisation import Filter, extended_jacobian, extended_state, zero_order_hold
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle


def extended_model(
    inputs: DesignInputs, coupling: str | float, point: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return A (11, 11), B (11, 2) of the ECM under held inputs.

    Args:
        inputs: Inputs of the co-design: its filter and period.
        coupling: Name of the set, or a multiple of the derived.
        point: Altitude (m) and velocity (m/s) of the trim.
    """
    vehicle, filter_ = load_vehicle().coupled(coupling), Filter(*series(continuous(_sections(inputs))))
    equilibrium = trim(vehicle, *point)
    state = extended_state(equilibrium.state, filter_)
    return zero_order_hold(*extended_jacobian(state, equilibrium.input, vehicle, filter_, False), inputs.model.period)


def codesigned_model(inputs: DesignInputs, point: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return A (11, 11), B (11, 2) of the co-designed polytopic model; arguments as above."""
    return polytopic_model(inputs.model, load_vehicle(), _sections(inputs)).whole.at(*point)


def _sections(inputs: DesignInputs) -> tuple[NotchSection, ...]:
    return tuple(NotchSection(**section.model_dump()) for section in inputs.notch)
