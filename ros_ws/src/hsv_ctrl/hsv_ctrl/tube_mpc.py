"""The Tube-MPC controller node."""

from __future__ import annotations

from collections.abc import Sequence

from hsv.control.control_law import tube_law
from hsv.control.integral_action import INTEGRAL_PARAMETERS
from hsv.control.tube_law import TUBE_PARAMETERS
from hsv.design.certificate import CERTIFICATE_PARAMETERS
from hsv.design.verification.preflight import preflight
from hsv_ctrl.controller import ControllerNode
from hsv_ctrl.design import declare_design
from hsv_node.main import run_node


class TubeMpcNode(ControllerNode):
    """Feedback about the nominal trajectory (paper eq. 36); refuses a design that fails its quick claims."""

    def __init__(self) -> None:
        super().__init__("tube_mpc")
        values = declare_design(self, (*INTEGRAL_PARAMETERS, *TUBE_PARAMETERS, *CERTIFICATE_PARAMETERS))
        if warning := preflight(values):
            self.get_logger().warning(warning)
        certified, flown = values["design.coupling"], values["vehicle.coupling"]
        if certified not in ("", flown):
            self.get_logger().warning(
                f"outside certified vehicle set: vehicle.coupling = {flown!r}, the tube is certified for {certified!r}"
            )
        self.law = tube_law(values)


def main(args: Sequence[str] | None = None) -> int:
    """Run the Tube-MPC controller node."""
    return run_node(TubeMpcNode, "tube_mpc", args)
