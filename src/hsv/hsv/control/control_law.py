"""The common interface of the controllers, and the one that the parameters describe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from hsv.control.controllers import CONTROLLER_PARAMETERS
from hsv.control.design_file import ControlDesign
from hsv.control.integral_action import INTEGRAL_PARAMETERS, IntegralTubeLaw
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeLaw, TubeResult
from hsv.parameters import check_all


class ControlLaw(Protocol):
    """From measured, reference and nominal state to the input of a step."""

    def reset(self) -> None:
        """Start a new run."""

    def step(
        self,
        state: np.ndarray,
        filtered_pitch_rate: float,
        filter_state: np.ndarray,
        reference: np.ndarray,
        reference_input: np.ndarray,
        deviation: np.ndarray,
        nominal_input: np.ndarray,
    ) -> TubeResult:
        """Return the input of this step from x (9), q_f (rad/s), s (2 s), x_r (9), u_r (2), x_n (9) and u_n (2)."""


def tube_law(values: Mapping[str, Any], design: ControlDesign | None = None) -> TubeLaw | IntegralTubeLaw:
    """Return the tube law that the parameters describe, with integral action where ``integral.rate`` is not zero.

    ``design``: the one in ``values``, where it is known already.
    """
    if check_all(INTEGRAL_PARAMETERS, values)["integral.rate"] > 0.0:
        return IntegralTubeLaw.from_parameters(values, design)
    return TubeLaw.from_parameters(values, design)


def control_law(values: Mapping[str, Any], design: ControlDesign | None = None) -> ControlLaw:
    """Return the controller that the parameters describe.

    Args:
        values: Flat parameters.
        design: The design in ``values``, where it is known already.

    Raises:
        ParameterError, DesignError: A wrong value, named.
    """
    if check_all(CONTROLLER_PARAMETERS, values)["controller"] == "robust_mpc":
        return RobustMpc.from_parameters(values, design)
    return tube_law(values, design)
