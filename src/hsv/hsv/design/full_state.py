"""The full-state feedback F' of the paper's section 4.3, and why it does not fly: it cancels the notch filter.

In the decoupled ECM the pitch rate is a combination of q' and the filter's states, q = (q' - C s) / D, and nothing in
the model speaks against feeding it back. So the best full-state gain rebuilds it: its action on (q, s) is that of the
gain on q, with next to nothing left on s, and the flexible modes, which the filter was there for, are excited again.
With the filter's columns of F' at zero the feedback sees q' alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import continuous, series
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import DesignInputs
from hsv.model.lpv.linearisation import Filter, extended_jacobian, extended_state, from_true_rate, zero_order_hold
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_RIGID, N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


def full_state_report(
    inputs: DesignInputs, design: ControlDesign, whole: Polytope, columns: np.ndarray
) -> dict[str, Any]:
    """Return the full-state and the structured gain, and the effect of each on the coupled vehicle, for JSON.

    Args:
        inputs: Scales and target of the design.
        design: Design with the structured gain.
        whole: The co-designed polytopic model, filter states after the nine.
        columns: (5, d) disturbances that the feedback is to reject, as for the structured gain.

    Raises:
        DesignError: No full-state gain.
    """
    notch = Filter(*series(continuous(design.notch)))
    kept = [*range(N_RIGID), *range(N_STATES, N_STATES + len(notch.B))]
    disturbance = np.zeros((len(kept), columns.shape[1]))
    disturbance[:N_RIGID] = columns
    disturbance[PITCH_RATE] *= notch.D
    found = feedback_gain(
        whole.A[:, kept][:, :, kept],
        whole.B[:, kept],
        disturbance,
        inputs.error_scale(),
        inputs.feedback.input_scale.array(),
    )
    target = inputs.nominal.target
    on_true_rate = found.F @ from_true_rate(notch)[np.ix_(kept, kept)]
    return {
        "gain": found.F.tolist(),
        "spectral_radii": found.radii.tolist(),
        "elevator_on_pitch_rate": float(on_true_rate[1, PITCH_RATE]),
        "structured_elevator_on_pitch_rate": float(design.feedback_gain[1, PITCH_RATE]),
        "largest_real_part": largest_real_parts(
            design, inputs.flown_vehicle, found.F, (target.altitude, target.velocity)
        ),
    }


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
