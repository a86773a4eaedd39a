"""The live node: displays a running flight in Foxglove and on a page, and forwards the page's commands to the nodes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from hsv_msgs.msg import Run, VehicleState
from hsv_msgs.srv import ClearFault, InjectFault
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from hsv.bags.description import (
    CONTROLLER,
    DIAGNOSTICS,
    LAST_STATE,
    LATCHED_TOPICS,
    LIVE,
    OTHER_TOPICS,
    PARAMETER_EVENTS,
    PLANT,
    RUN,
    STATE,
    TOPICS,
    NodeDescription,
)
from hsv.bags.infrastructure_parameters import LIVE_PARAMETERS
from hsv.bags.messages import stamp_in
from hsv.graph.node_parameters import SETTABLE, step_in
from hsv.graph.standstill import Standstill
from hsv.model.signals import INPUT_NAMES
from hsv.pages.layouts import foxglove_layout
from hsv.pages.live.commands import Change, Command, Inject
from hsv.pages.live.foxglove_server import FoxgloveServer
from hsv.pages.live.hub import Hub
from hsv.pages.live.server import Answer, PageServer
from hsv_bringup.client import ABSENT_AFTER, SILENT_AFTER
from hsv_bringup.flow_executor import FlowExecutor
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, ServiceCall, fault_message, message_class
from hsv_node.parameters import declare, refuse_unknown
from hsv_node.process import ProcessNode
from hsv_node.roles import name_of

RATE = 20.0
"""Polling rate (Hz): rows per second for the page, and batches per second for Foxglove."""

WATCHING = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Quality of service of a viewer: publishers do not wait for it, and at full speed it may miss messages."""


class LiveExecutor(FlowExecutor):
    """An executor that polls at a fixed rate, because taking many messages costs little more than taking one."""

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Sleep for ``timeout_sec``, then take all messages that have arrived, and check for responses of services."""
        time.sleep(timeout_sec or 0.0)
        self.drain()
        if any(True for node in self.get_nodes() for _ in node.clients):
            SingleThreadedExecutor.spin_once(self, 0.0)


@dataclass
class _Request:
    """A pending service request to a node."""

    role: NodeDescription
    kind: Any
    request: Any
    done: Callable[[Any], None]
    """Function called with the response."""
    refused: Callable[[str], None] = lambda reason: None
    """Function called with the reason if no response arrives."""
    call: ServiceCall | None = None
    standstill: Standstill = field(default_factory=Standstill)


class LiveNode(ProcessNode):
    """A node that forwards messages to Foxglove, samples them for the page, and executes the page's commands."""

    def __init__(self) -> None:
        # Without rosout and parameter services, so that nothing of this node is recorded with the flight.
        super().__init__(LIVE.name, enable_rosout=False, start_parameter_services=False)
        refuse_unknown(self, LIVE.name)
        values = declare(self, LIVE_PARAMETERS)
        kinds = TOPICS | OTHER_TOPICS
        self._kinds = {topic: message_class(kind) for topic, kind in kinds.items()}
        self._names = {topic: self.resolve_topic_name(topic) for topic in kinds}
        self.hub = Hub(self._decode, {"title": values["live.title"], "bag": values["live.bag"]})
        names = {self._names[topic]: kind for topic, kind in kinds.items()}
        self.foxglove = FoxgloveServer(values["live.port"], names, [self._names[topic] for topic in LATCHED_TOPICS])
        layout = foxglove_layout(lambda topic: self._names.get(topic) or self.resolve_topic_name(topic))
        self.page = PageServer(values["live.page_port"], self.hub, layout)
        self._run: Run | None = None
        self._plant = ""
        """Full name of the plant, or empty until it is found."""
        self._requests: list[_Request] = []
        self._next_poll = time.monotonic()
        # The executor takes subscriptions in this order: a run before its messages, its end after them.
        self.create_subscription(Run, RUN, self._on_run, LATCHED, raw=True)
        for topic in TOPICS:
            self._watch(topic, partial(self._on_step_message, topic))
        for topic in OTHER_TOPICS:
            if topic != RUN:
                self._watch(topic, partial(self._on_other_message, topic))
        self.create_subscription(VehicleState, LAST_STATE, self._on_last_state, WATCHING)
        print(f"live page: {self.page.url}")
        viewers = f"Foxglove, Lichtblick; layout {self.page.layout_url}"
        print(f"live data: ws://127.0.0.1:{self.foxglove.port} ({viewers})", flush=True)

    def poll(self) -> None:
        """Sample the messages that have arrived, execute new commands, and handle responses to earlier requests."""
        self._next_poll = max(self._next_poll + 1.0 / RATE, time.monotonic())
        self.hub.sample()
        while not self.page.commands.empty():
            self._execute(*self.page.commands.get())
        self._requests = [request for request in self._requests if not self._finished(request)]
        self._check_plant()

    def wait_timeout(self) -> float:
        """Return the time (s) to the next poll."""
        return max(self._next_poll - time.monotonic(), 0.0)

    def close(self) -> None:
        """Forward the last messages and disconnect the viewers."""
        if isinstance(self.executor, LiveExecutor):
            self.executor.drain()
        self._check_plant()
        self.hub.sample()
        self.page.close()
        self.foxglove.close()

    def _watch(self, topic: str, callback: Callable[[bytes], None]) -> None:
        profile = LATCHED if topic in LATCHED_TOPICS else WATCHING
        self.create_subscription(self._kinds[topic], topic, callback, profile, raw=True)

    def _decode(self, topic: str, data: bytes) -> Any:
        return deserialize_message(data, self._kinds[topic])

    def _on_step_message(self, topic: str, data: bytes) -> None:
        stamp = stamp_in(data)
        self.foxglove.send(self._names[topic], stamp, data)
        self.hub.offer(topic, stamp, data)

    def _on_other_message(self, topic: str, data: bytes) -> None:
        self.foxglove.send(self._names[topic], self.hub.time, data)
        if topic == DIAGNOSTICS:
            self._on_diagnostics(self._decode(topic, data))
        elif topic == PARAMETER_EVENTS:
            event = self._decode(topic, data)
            if event.node == self._plant:
                self._on_settings({p.name: parameter_value_to_python(p.value) for p in event.changed_parameters})

    def _on_run(self, data: bytes) -> None:
        self._run = run = self._decode(RUN, data)
        self.foxglove.start_run()
        self.hub.start_run(run.run_id, run.period, run.last_step)
        self.foxglove.send(self._names[RUN], 0, data)
        self._ask_parameters(PLANT, [name for name, (node, _) in SETTABLE.items() if node is PLANT], self._on_settings)
        self._ask_parameters(CONTROLLER, ["input.minimum", "input.maximum"], self._on_limits)

    def _on_last_state(self, state: VehicleState) -> None:
        self.hub.sample()
        self.hub.end(state.status, state.step)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            node = status.name.partition(": ")[0]  # "node: task"
            level = status.level[0] if isinstance(status.level, bytes) else status.level
            self.hub.diagnose(node, level, status.message, {pair.key: pair.value for pair in status.values})
            if level:
                self.hub.note(f"{node}: {status.message}", warning=True)

    def _on_settings(self, values: dict[str, Any]) -> None:
        settings = {name: value for name, value in values.items() if name in SETTABLE}
        self.hub.update(settings=self.hub.status()["settings"] | settings)

    def _on_limits(self, values: dict[str, Any]) -> None:
        low, high = (list(values.get(f"input.{end}") or ()) for end in ("minimum", "maximum"))
        self.hub.update(limits=dict(zip(INPUT_NAMES, zip(low, high, strict=False), strict=False)))

    def _check_plant(self) -> None:
        """Report the run as broken off if the plant has disappeared without announcing its end."""
        if self._run is None or self.hub.status()["ending"] is not None or not self.hub.time:
            return
        if not self.count_publishers(STATE):
            self.hub.end(VehicleState.RUNNING, round(self.hub.time * 1e-9 / self._run.period))

    def _ask_parameters(
        self, role: NodeDescription, names: Iterable[str], take: Callable[[dict[str, Any]], None]
    ) -> None:
        names = list(names)

        def done(response: GetParameters.Response) -> None:
            take(dict(zip(names, map(parameter_value_to_python, response.values), strict=False)))

        # An external controller may not have these parameters; the page then omits them.
        self._requests.append(_Request(role, GetParameters, GetParameters.Request(names=names), done))

    def _execute(self, command: Command, answer: Answer) -> None:
        def refuse(why: str) -> None:
            answer({"accepted": False, "message": why})

        def done(response: Any) -> None:
            if isinstance(command, Change):
                result = response.results[0]
                accepted, words = result.successful, result.reason
            else:
                accepted, words = response.success, response.message
            if not accepted:
                refuse(words)
                return
            step = step_in(words) if isinstance(command, Change) else response.step
            if isinstance(command, Change):  # the hub adds events for faults when they act
                self.hub.note(words, step=step)
            period = self._run.period if self._run else 0.0
            answer({"accepted": True, "message": f"{words}, t = {step * period:.2f} s", "step": step})

        kind, request = _service_request(command)
        self._requests.append(_Request(command.node, kind, request, done, refuse))

    def _finished(self, request: _Request) -> bool:
        """Send a request, or handle its response if there is one; return whether it is answered or given up."""
        if request.call and (response := request.call.response()):
            request.call.close()
            request.done(response)
            return True
        if request.call is None and (name := name_of(self, request.role, request.kind)):
            request.call = ServiceCall(self, request.kind, name, request.request)
            if request.kind is GetParameters and request.role is PLANT:
                self._plant = name.rpartition("/")[0]
        still = request.standstill.look(sorted(self.get_node_names_and_namespaces()))
        if silent := still > (SILENT_AFTER if request.call else ABSENT_AFTER):
            if request.call:
                request.call.close()
            request.refused(f"no answer from the {request.role.name} for {still:.0f} s")
        return silent


def _service_request(command: Command) -> tuple[Any, Any]:
    """Return service type and request message for a command."""
    if isinstance(command, Change):
        parameter = RosParameter(command.parameter.name, value=command.value).to_parameter_msg()
        return SetParameters, SetParameters.Request(parameters=[parameter])
    if isinstance(command, Inject):
        fault = fault_message(command.fault.channel, command.fault.type, command.fault.parameters)
        return InjectFault, InjectFault.Request(fault=fault, duration=command.duration)
    return ClearFault, ClearFault.Request(channel=command.channel, type=command.type)


main = partial(run_node, LiveNode, LIVE.name, executor_class=LiveExecutor)
