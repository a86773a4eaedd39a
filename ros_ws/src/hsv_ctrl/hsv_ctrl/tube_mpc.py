"""The Tube-MPC controller node."""

from __future__ import annotations

from collections.abc import Sequence

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from hsv.bags.description import TUBE_MPC
from hsv.base.errors import DesignError, ParameterError
from hsv.control.coverage import uncovered_hardware
from hsv.control.design import CERTIFICATE_PARAMETERS, TAU
from hsv.control.effectiveness import EFFECTIVENESS_ENABLED, WATCHED_PARAMETERS
from hsv.control.tube_law import TUBE_PARAMETERS, TubeLaw
from hsv.control.verification import preflight
from hsv_ctrl.design import declare_design
from hsv_ctrl.tube import TubeNode
from hsv_node.main import run_node
from hsv_node.parameters import declare, declare_vehicle


class TubeMpcNode(TubeNode):
    """Feedback about the nominal trajectory (paper eq. 36); refuses a design that fails its quick claims."""

    def __init__(self) -> None:
        super().__init__(TUBE_MPC)
        values, design = declare_design(self, (*TUBE_PARAMETERS, *CERTIFICATE_PARAMETERS))
        if design is None:
            raise DesignError("parameter design.name = 'none': expected a design with a tube")
        if values[EFFECTIVENESS_ENABLED.name]:
            # Of what only the estimator needs, a node without one has none.
            declare_vehicle(self)
            values |= declare(self, WATCHED_PARAMETERS)
        if warning := preflight(design, values["design.certificate"]):
            self.get_logger().warning(warning)
        certified, flown = design.coupling, values["vehicle.coupling"]
        if certified not in ("", flown):
            self.get_logger().warning(
                f"outside certified vehicle set: vehicle.coupling = {flown!r}, the tube is certified for {certified!r}"
            )
        if values["vehicle.digest"] != design.vehicle:
            self.get_logger().warning(
                "vehicle.digest: not that of the design, the tube is certified for another vehicle"
            )
        for thing in uncovered_hardware(values, design) if design.tube else ():
            self.get_logger().warning(f"not covered by the certificate: {thing}")
        self.component = self._law = TubeLaw.from_parameters(values, design)
        self.add_on_set_parameters_callback(self._on_change)

    def _on_change(self, parameters: list[Parameter]) -> SetParametersResult:
        """Fly with another ``feedback.tau``, the one parameter that is not read-only, from the next step on."""
        for parameter in parameters:
            if parameter.name == TAU.name:
                values = list(parameter.value)
                try:
                    step = self._law.change_tau(values)
                except ParameterError as error:
                    return SetParametersResult(successful=False, reason=str(error))
                self.say_change(f"{TAU.name} = {values} from step {step} on")
        return SetParametersResult(successful=True)


def main(args: Sequence[str] | None = None) -> int:
    """Run the Tube-MPC controller node."""
    return run_node(TubeMpcNode, "tube_mpc", args)
