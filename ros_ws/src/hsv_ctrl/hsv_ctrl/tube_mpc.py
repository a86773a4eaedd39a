"""The Tube-MPC controller node."""

from __future__ import annotations

from collections.abc import Sequence

from hsv.control.control_law import tube_law
from hsv.control.integral_action import INTEGRAL_PARAMETERS
from hsv_ctrl.controller import ControllerNode
from hsv_ctrl.design import declare_design
from hsv_node.main import run_node


class TubeMpcNode(ControllerNode):
    """Feedback about the nominal trajectory (paper eq. 36)."""

    def __init__(self) -> None:
        super().__init__("tube_mpc")
        self.law = tube_law(declare_design(self, INTEGRAL_PARAMETERS))


def main(args: Sequence[str] | None = None) -> int:
    """Run the Tube-MPC controller node."""
    return run_node(TubeMpcNode, "tube_mpc", args)
