"""The controller that the parameters describe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hsv.control.controller import Controller
from hsv.control.controllers import CONTROLLER_PARAMETERS
from hsv.control.design_file import ControlDesign
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeLaw
from hsv.parameters import check_all


def control_law(values: Mapping[str, Any], design: ControlDesign | None = None) -> Controller:
    """Return the controller that the parameters describe.

    Args:
        values: Flat parameters.
        design: The design in ``values``, where it is known already.

    Raises:
        ParameterError, DesignError: A wrong value, named.
    """
    if check_all(CONTROLLER_PARAMETERS, values)["controller"] == "robust_mpc":
        return RobustMpc.from_parameters(values, design)
    return TubeLaw.from_parameters(values, design)
