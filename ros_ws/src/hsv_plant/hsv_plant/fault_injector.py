"""The fault injector node: between the controller's command and the actuator."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import ControlInput, FaultStatus, Run
from hsv_msgs.msg import Fault as FaultMessage
from hsv_msgs.srv import ClearFault, InjectFault

from hsv.errors import ParameterError
from hsv.faults.actuator import FAULT_PARAMETERS, Fault, FaultInjector
from hsv.graph.description import ACTUATOR, CLEAR_FAULT, COMMAND, FAULT_INJECTOR, FAULT_STATUS, INJECT_FAULT
from hsv.graph.exchange import actuate, fill_fault_status
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node
from hsv_node.parameters import declare


class FaultInjectorNode(PeerNode):
    """Turns the command into that of the actuators, and says which faults act."""

    def __init__(self) -> None:
        super().__init__(FAULT_INJECTOR, "faults")
        self.injector = FaultInjector.from_parameters(declare(self, FAULT_PARAMETERS))
        self._actuator_message, self._status_message = ControlInput(), FaultStatus()
        self._actuator = self.create_step_publisher(ACTUATOR)
        self._status = self.create_step_publisher(FAULT_STATUS)
        self.create_step_subscription(COMMAND, self._on_command)
        self.create_service(InjectFault, INJECT_FAULT, self._inject)
        self.create_service(ClearFault, CLEAR_FAULT, self._clear)

    def start_run(self, run: Run) -> None:
        """Return to the scheduled faults."""
        self.injector.reset()

    def _on_command(self, command: ControlInput) -> None:
        result = actuate(self.injector, command, self._actuator_message)
        self._actuator.publish(self._actuator_message)
        fill_fault_status(result, command, FaultMessage, self._status_message)
        self._status.publish(self._status_message)
        self.diagnose(command.header.stamp, "faults act" if result.active else "no fault", step=command.step)

    def _inject(self, request: InjectFault.Request, response: InjectFault.Response) -> InjectFault.Response:
        try:
            fault = Fault(request.fault.channel, request.fault.type, request.fault.value)
        except ParameterError as error:
            response.accepted, response.message = False, str(error)
            return response
        response.step = self.injector.inject(fault)
        response.accepted = True
        response.message = f"{fault.type} {fault.value:g} of {fault.channel} from step {response.step} on"
        self.get_logger().info(response.message)
        return response

    def _clear(self, request: ClearFault.Request, response: ClearFault.Response) -> ClearFault.Response:
        try:
            response.step = self.injector.clear(request.channel)
        except ParameterError as error:
            response.accepted, response.message = False, str(error)
            return response
        response.accepted = True
        response.message = f"no fault of {request.channel or 'any channel'} from step {response.step} on"
        self.get_logger().info(response.message)
        return response


def main(args: Sequence[str] | None = None) -> int:
    """Run the fault injector node."""
    return run_node(FaultInjectorNode, "fault_injector", args)
