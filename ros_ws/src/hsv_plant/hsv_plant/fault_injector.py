"""The fault injector node: applies the command link and the faults to the command of the controller."""

from __future__ import annotations

from functools import partial

from hsv_msgs.msg import Run
from hsv_msgs.srv import ClearFault, InjectFault

from hsv.bags.description import CLEAR_FAULT, COMMAND, FAULT_INJECTOR, INJECT_FAULT
from hsv.bags.messages import fault_in, stamp_in, stamp_of
from hsv.flight.blocks import Signals
from hsv.model.faults.injector import DURATION, FAULT_PARAMETERS, LINK_PARAMETERS, FaultInjector
from hsv.model.links import command_link
from hsv.model.signals import NEVER, first_step
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import declare, declare_vehicle


class FaultInjectorNode(BlockNode):
    """A node that publishes, for each command, the input of the actuators and the active faults."""

    def __init__(self) -> None:
        super().__init__(FAULT_INJECTOR, "faults")
        values = declare(self, (*FAULT_PARAMETERS, *LINK_PARAMETERS))
        if not command_link(values, values["period"]).ideal:
            # Only a link needs the parameters of the vehicle.
            declare_vehicle(self)
            values = declare(self, FaultInjector.PARAMETERS)
        self._period = values["period"]
        self._due_step = 0
        """Next step for which a command is expected."""
        self.component = self._injector = FaultInjector.from_parameters(values)
        self.serve(InjectFault, INJECT_FAULT, self._inject)
        self.serve(ClearFault, CLEAR_FAULT, self._clear)

    def start_run(self, run: Run) -> None:
        """Restart with step 0 and the scheduled faults only."""
        super().start_run(run)
        self._due_step = 0

    def on_message(self, topic: str, message: bytes) -> None:
        """Process a command; in a run for which this node is ready, fail if its step or time is not as expected."""
        if self.announced is not None:
            step, (seconds, nanoseconds) = self.messages[topic].step(message), stamp_of(self._due_step, self._period)
            if step != self._due_step or stamp_in(message) != seconds * 10**9 + nanoseconds:
                self._refuse(topic, step, stamp_in(message) * 1e-9)
                return
            self._due_step += 1
        super().on_message(topic, message)

    def missing_links(self) -> list[str]:
        """Return missing topic links: "tube_mpc (/hsv/command)"; without any, fail if two nodes publish commands."""
        missing = super().missing_links()
        if not missing:
            self._refuse_two()
        return missing

    def _refuse(self, topic: str, step: int, time: float) -> None:
        if not self._refuse_two():
            name = (self.publishers_of(topic) or ["the controller"])[0]
            answered = f"{name} answered step {step} at {time:.2f} s on {self.resolve_topic_name(topic)}"
            self.fail(f"{answered}, expected step {self._due_step} at {self._due_step * self._period:.2f} s")

    def _refuse_two(self) -> bool:
        names = self.publishers_of(COMMAND)
        if two := len(names) > 1:
            self.fail(f"{' and '.join(names)} publish {self.resolve_topic_name(COMMAND)}: expected one controller")
        return two

    def stepped(self, signals: Signals) -> None:
        """Publish the diagnostics, with whether a fault acts."""
        self.diagnose(signals, "faults act" if signals.active_faults else "no fault")

    def _inject(self, request: InjectFault.Request) -> tuple[int, str]:
        fault = fault_in(request.fault)
        DURATION.check(request.duration)
        steps = first_step(request.duration, self._period) if request.duration else NEVER
        step = self._injector.inject(fault, steps)
        until = f" to step {step + steps - 1}" if request.duration else " on"
        return step, f"{fault} from step {step}{until}"

    def _clear(self, request: ClearFault.Request) -> tuple[int, str]:
        step = self._injector.clear(request.channel, request.type)
        return step, f"no {request.type or 'fault'} of {request.channel or 'any channel'} from step {step} on"


main = partial(run_node, FaultInjectorNode, "fault_injector")
