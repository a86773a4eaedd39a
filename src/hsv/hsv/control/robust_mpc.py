"""Robust MPC without a tube, the paper's comparison (section 5.2): u = K (x - x_r) + u_r, within the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.control.controller import Controller, ControllerInput
from hsv.control.design import ControlDesign
from hsv.control.tube_law import TubeResult, TubeStatusCode, TubeStep, tube_data
from hsv.core import Struct
from hsv.model.signals import N_RIGID

ROBUST_MPC_PARAMETERS = (Parameter("robust_mpc.gain_index", 0, "which of nominal.gains: 0 the outermost", "", 0, 63),)


class RobustMpc(Controller):
    """Robust MPC without a tube: one of the nominal gains K acts on the deviation from the reference; no memory."""

    PARAMETERS = ROBUST_MPC_PARAMETERS
    in_core = True
    kernel: Struct

    def __init__(self, design: ControlDesign, gain_index: int = 0) -> None:
        """Use the gain with index ``gain_index`` in the family of ``design``, 0 for the outermost ellipsoid.

        Raises:
            ParameterError: The design has no such gain.
        """
        gains = design.nominal_gains
        if not 0 <= gain_index < len(gains):
            raise ParameterError(f"parameter robust_mpc.gain_index = {gain_index}: expected 0 to {len(gains) - 1}")
        self.kernel = tube_data(gains[gain_index][None], design.input_minimum, design.input_maximum, design.period)
        self._step = TubeStep(monitored=False)

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign) -> Self:
        """Build from ``design`` and the flat parameters ``values``, see :data:`ROBUST_MPC_PARAMETERS`."""
        return cls(design, validate(ROBUST_MPC_PARAMETERS, values)["robust_mpc.gain_index"])

    def reset(self) -> None:
        """Do nothing: this law has no state."""

    def step(self, inputs: ControllerInput) -> TubeResult:
        """Return the result of this step; its error is x - x_r of the rigid states, and it has no invariant set."""
        feedback, total, u, _ = self._step(self.kernel, inputs)
        finite = math.isfinite(total[0]) and math.isfinite(total[1])
        return TubeResult(
            input=u,
            u_unsaturated=total,
            error=(inputs.estimate - inputs.reference)[:N_RIGID],
            tube_centre=np.empty(0),
            tube_half_width=np.empty(0),
            level=math.nan,
            inside=False,
            component="",
            u_feedback=feedback,
            u_nominal=np.zeros(2),
            tau=np.ones(1),
            status=TubeStatusCode.NO_SET if finite else TubeStatusCode.INVALID_INPUT,
        )
