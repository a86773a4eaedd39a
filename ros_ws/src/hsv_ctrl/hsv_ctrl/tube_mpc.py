"""The controller nodes that report the status of the tube: Tube-MPC, and the paper's robust MPC without a tube."""

from __future__ import annotations

from functools import partial

from hsv_msgs.msg import Run
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from hsv.bags.description import ROBUST_MPC, TUBE_MPC, NodeDescription
from hsv.base.errors import DesignError, ParameterError
from hsv.certificate.verification import preflight
from hsv.control.design import TAU, ControlDesign
from hsv.control.design_file import CERTIFICATE_PARAMETERS
from hsv.control.effectiveness import EFFECTIVENESS_ENABLED, WATCHED_PARAMETERS, EffectivenessMode
from hsv.control.hardware import uncovered_hardware
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS, RobustMpc
from hsv.control.tube_law import TUBE_PARAMETERS, TubeLaw, TubeResult, TubeStatusCode
from hsv.flight.blocks import Signals
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import declare, declare_design, declare_vehicle, given


class TubeNode(BlockNode):
    """A controller node that reports the tube status: where the error lies, inside or outside the invariant set.

    Raises:
        ParameterError: The parameter ``controller`` names another controller.
    """

    def __init__(self, role: NodeDescription) -> None:
        super().__init__(role, "tube")
        if given(self, "controller") and self.controller != role.name:
            raise ParameterError(
                f"parameter controller = {self.controller!r}: expected {role.name}, which this node is"
            )
        self._outside = False
        self._mode = EffectivenessMode.HEALTHY

    def start_run(self, run: Run) -> None:
        """Reset the tube status for a new run: the error counts as inside the tube, the elevator as healthy."""
        super().start_run(run)
        self._outside = False
        self._mode = EffectivenessMode.HEALTHY

    def stepped(self, signals: Signals) -> None:
        """Publish the tube status as diagnostics; warn on leaving the tube or on a new diagnosis of the elevator."""
        result = signals.diagnostics
        assert isinstance(result, TubeResult)
        outside = result.status is TubeStatusCode.OUTSIDE
        left, self._outside = outside and not self._outside, outside
        if left:
            time = signals.stamp[0] + 1e-9 * signals.stamp[1]
            self.get_logger().warning(f"left the tube at {time:.2f} s: {result.component}, level {result.level:.3f}")
        summary, found, changed = result.status.name, result.effectiveness, False
        if found and found.mode is not self._mode:
            changed, self._mode, summary = True, found.mode, f"elevator {found}"
            self.get_logger().warning(summary)
        if self.diagnosed(signals) and not (left or changed):
            return
        values = {"saturated": bool(result.saturated.any()), "level": result.level, "component": result.component}
        if found:
            values |= {"effectiveness": found.estimate, "effectiveness_low": found.low}
            values |= {"effectiveness_high": found.high, "elevator": found.mode.name}
        self.diagnose(signals, summary, warning=left or changed, **values)


class TubeMpcNode(TubeNode):
    """The Tube-MPC node: feedback about the nominal trajectory (paper eq. 36); a design must pass :func:`preflight`."""

    def __init__(self) -> None:
        super().__init__(TUBE_MPC)
        values, design = declare_design(self, (*TUBE_PARAMETERS, *CERTIFICATE_PARAMETERS))
        design = _required(design, "a design with a tube")
        if values[EFFECTIVENESS_ENABLED.name]:
            # Only the estimator needs the parameters of the vehicle.
            declare_vehicle(self)
            values |= declare(self, WATCHED_PARAMETERS)
        if warning := preflight(design, values["design.certificate"]):
            self.get_logger().warning(warning)
        warn = self.get_logger().warning
        certified, flown = design.coupling, values["vehicle.coupling"]
        if certified not in ("", flown):
            warn(
                f"outside certified vehicle set: vehicle.coupling = {flown!r}, the tube is certified for {certified!r}"
            )
        if values["vehicle.digest"] != design.vehicle:
            warn("vehicle.digest: not that of the design, the tube is certified for another vehicle")
        for thing in uncovered_hardware(values, design) if design.tube else ():
            warn(f"not covered by the certificate: {thing}")
        self.component = self._law = TubeLaw.from_parameters(values, design)
        self.add_on_set_parameters_callback(self._on_change)

    def _on_change(self, parameters: list[Parameter]) -> SetParametersResult:
        """Change ``feedback.tau`` from the next step on, or reject it; the law's other parameters are read-only."""
        for parameter in parameters:
            if parameter.name == TAU.name:
                values = list(parameter.value)
                try:
                    step = self._law.change_tau(values)
                except ParameterError as error:
                    return SetParametersResult(successful=False, reason=str(error))
                self.log_change(f"{TAU.name} = {values} from step {step} on")
        return SetParametersResult(successful=True)


def _required(design: ControlDesign | None, expected: str) -> ControlDesign:
    if design is None:
        raise DesignError(f"parameter design.name = 'none': expected {expected}")
    return design


main = partial(run_node, TubeMpcNode, "tube_mpc")


class RobustMpcNode(TubeNode):
    """The robust MPC node: feedback with one gain about the reference that the nominal trajectory node publishes."""

    def __init__(self) -> None:
        super().__init__(ROBUST_MPC)
        values, design = declare_design(self, ROBUST_MPC_PARAMETERS)
        self.component = RobustMpc.from_parameters(values, _required(design, "one with nominal gains"))


robust_main = partial(run_node, RobustMpcNode, "robust_mpc")
