"""Effect of a feedback designed on the decoupled model on the elastic modes of the coupled vehicle."""

from __future__ import annotations

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import continuous, series
from hsv.model.lpv.linearisation import Filter, extended_jacobian, extended_state, zero_order_hold
from hsv.model.signals import N_RIGID, N_STATES
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


def largest_real_parts(
    design: ControlDesign, vehicle: Vehicle, full: np.ndarray, point: tuple[float, float]
) -> dict[str, dict[str, float]]:
    """Return the rightmost pole (1/s) of the sampled loop around the coupled ECM at a trim.

    Args:
        design: Design with the structured gain F', flown with the tube factor 1.
        vehicle: Vehicle of the design.
        full: (2, 5 + k) the full-state gain on rigid states and filter.
        point: Altitude (m) and velocity (m/s) of the trim.

    Returns:
        By gain, ``"structured"`` and ``"full_state"``, and set of inertial coupling.
    """
    notch = Filter(*series(continuous(design.notch)))
    found: dict[str, dict[str, float]] = {"structured": {}, "full_state": {}}
    for coupling in vehicle.couplings:
        coupled = vehicle.coupled(coupling)
        level = trim(coupled, *point)
        A, B = extended_jacobian(extended_state(level.state, notch), level.input, coupled, notch, False)
        A, B = zero_order_hold(A, B, design.period)
        structured, whole = np.zeros((2, len(A))), np.zeros((2, len(A)))
        structured[:, :N_RIGID] = design.feedback_gain[:, :N_RIGID]
        whole[:, :N_RIGID], whole[:, N_STATES:] = full[:, :N_RIGID], full[:, N_RIGID:]
        for name, gain in (("structured", structured), ("full_state", whole)):
            radius = float(np.abs(np.linalg.eigvals(A + B @ gain)).max())
            found[name][coupling] = float(np.log(radius) / design.period)
    return found
