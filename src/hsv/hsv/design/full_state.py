"""The full-state feedback F' of the paper's section 4.3, and why it is not used: it cancels the notch filter.

The decoupled ECM, the model with the notch filter, contains the filtered pitch rate q' and the filter states s. The
true pitch rate is q = (q' - C s) / D, and nothing in the model penalises its feedback. The best full-state gain
therefore reconstructs q and feeds it back, almost without other use of s. This excites the flexible modes, which the
filter is meant to remove. The structured gain of a design has zeros for the filter states: it feeds back q' only.
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
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES, PITCH_RATE
from hsv.model.trim import trim


def full_state_report(
    inputs: DesignInputs, design: ControlDesign, whole: Polytope, columns: np.ndarray
) -> dict[str, Any]:
    """Return the full-state gain, compared with the structured gain on the coupled vehicle, for JSON.

    ``largest_real_part``: by gain and by set of inertial coupling, the real part (1/s) of the rightmost pole of the
    sampled loop, log(spectral radius) / period, with the coupled ECM at the target's trim and the tube factor 1.

    Args:
        inputs: Scales and target of the design.
        design: Design with the structured gain.
        whole: The co-designed polytopic model, with the filter states after the nine states of the vehicle.
        columns: (5, d) disturbance columns for which the structured gain was computed.

    Raises:
        DesignError: There is no full-state gain.
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
    on_true_rate = found.F @ from_true_rate(notch)[np.ix_(kept, kept)]
    gains = {"structured": design.feedback_gain[:, :N_RIGID], "full_state": found.F}
    poles: dict[str, dict[str, float]] = {name: {} for name in gains}
    for coupling in inputs.flown_vehicle.couplings:
        coupled = inputs.flown_vehicle.coupled(coupling)
        level = trim(coupled, inputs.nominal.target.altitude, inputs.nominal.target.velocity)
        jacobian = extended_jacobian(extended_state(level.state, notch), level.input, coupled, notch, False)
        A, B = zero_order_hold(*jacobian, design.period)
        for name, gain in gains.items():
            F = np.zeros((N_INPUTS, len(A)))
            F[:, kept[: gain.shape[1]]] = gain
            radius = float(np.abs(np.linalg.eigvals(A + B @ F)).max())
            poles[name][coupling] = float(np.log(radius) / design.period)
    return {
        "gain": found.F.tolist(),
        "spectral_radii": found.radii.tolist(),
        "elevator_on_pitch_rate": float(on_true_rate[1, PITCH_RATE]),
        "structured_elevator_on_pitch_rate": float(design.feedback_gain[1, PITCH_RATE]),
        "largest_real_part": poles,
    }
