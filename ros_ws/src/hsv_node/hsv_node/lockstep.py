"""Base classes of the nodes of the graph: parameters, links, diagnostics, and the start once all nodes are ready."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hsv_msgs.msg import Ready, Run, VehicleState
from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import QoSSubscriptionMatchedInfo, SubscriptionEventCallbacks
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from hsv.bags import description
from hsv.bags.description import NodeDescription
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.base.errors import RunError
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.flight.blocks import Signals
from hsv.plugins.controllers import class_place
from hsv_node.middleware import LATCHED, STEP, message_class
from hsv_node.parameters import declare, refuse_unknown
from hsv_node.process import ProcessNode
from hsv_node.roles import full_name, node_in_role, published_types

FIRST_LOG_AFTER = 2.0
"""Time (s) of waiting for peers before the first log message about it."""

LOG_INTERVAL = 10.0
"""Time (s) between repeated log messages."""

LINK_CHECK = 0.05
"""Time (s) between checks of the links until they are matched."""


class LockstepNode(ProcessNode):
    """A node of the graph description: it handles a step only when the messages that the step needs have arrived.

    It identifies its peers by the types of the messages that they publish, because names of nodes and topics may be
    remapped.

    Raises:
        RunError: Another node of this machine has its name or publishes its topics in the same domain and namespace.
        ParameterError: A parameter is wrong, such as an unknown ``controller``.
    """

    def __init__(self, role: NodeDescription, task: str = "") -> None:
        """Join the graph in ``role``; ``task`` follows the name of the node in the diagnostics."""
        super().__init__(role.name)
        self._task = task
        place = f"one {role.name} a domain and namespace (ROS_DOMAIN_ID, -r __ns:=)"
        self.claim(None, f"{place}, and another name for every other node (-r __node:=)")
        for topic in role.own_topics:
            self.claim(topic, place)
        if role.known_by:
            refuse_unknown(self, role.name)
        values = declare(self, LOCKSTEP_PARAMETERS)
        self.recorded, self.controller = bool(values["recorder"]), str(values["controller"])
        self.estimator = bool(values[ESTIMATOR_ENABLED.name])
        self.role = description.flown_role(role, self.estimator)
        if not description.controller_node(self.controller).foreign:
            class_place(self.controller)
        self._inputs: dict[str, Any] = {}
        self._outputs: dict[str, Any] = {}
        self._diagnostics = self.create_publisher(DiagnosticArray, description.DIAGNOSTICS, STEP)
        self._diagnosed_second = -1
        self._made = time.monotonic()
        self._next_log = self._made + FIRST_LOG_AFTER
        self._changed = ""
        """Description of the current parameter change, with the step at which it takes effect."""
        self._links: dict[str, list[NodeDescription]] = {}
        self.linked: dict[str, str] = {}
        """Full names of the linked nodes by role, updated by :meth:`missing_links`."""
        if role.known_by:
            for topic, peer in description.links(self.role, self.controller, self.recorded, self.estimator):
                self._links.setdefault(topic, []).append(peer)

    def create_step_subscription(self, topic: str, callback: Callable[[bytes], None]) -> None:
        """Subscribe to a step topic of the graph description; ``callback`` is called with the bytes of a message."""

        def take(message: bytes) -> None:
            if self.exit_code is None:  # otherwise the node is shutting down; the reason has been logged
                try:
                    callback(message)
                except RunError as error:
                    self.refuse_message(topic, error)

        kind = message_class(description.TOPICS[topic])
        self._inputs[topic] = self.create_subscription(kind, topic, take, STEP, raw=True)

    def refuse_message(self, topic: str, error: RunError) -> str:
        """Shut down because of an invalid message on ``topic``; return the logged error text."""
        return self.fail(f"{self.resolve_topic_name(topic)}: {error}")

    def fail(self, words: str, code: int = 1) -> str:
        """Log the error ``words``, end the process with exit code ``code``, and return ``words``.

        Callbacks use this instead of an exception, which rclpy would print with its traceback.
        """
        self.get_logger().fatal(words)
        self.finish(code)
        return words

    def create_step_publisher(self, topic: str) -> Callable[[bytes], None]:
        """Return a function that publishes the bytes of a message on a step topic of the graph description."""
        kind = description.TOPICS[topic]
        self._outputs[topic] = publisher = self.create_publisher(message_class(kind), topic, STEP)
        # Use the handle: the type check in rclpy's publish() takes half as long as the publication.
        publish: Callable[[bytes], None] = publisher.handle.publish_raw
        return publish

    def missing_links(self) -> list[str]:
        """Return the missing links, such as ``"tube_mpc (/hsv/nominal)"``; empty when all links are matched."""
        missing = []
        self.linked = {}
        here = self.get_name(), self.get_namespace()
        for topic, roles in self._links.items():
            own, seen = self.get_publishers_info_by_topic(topic), self.get_subscriptions_info_by_topic(topic)
            if topic in self._inputs:
                own, seen = seen, own
            definitions = [e.topic_type_hash for e in own if (e.node_name, e.node_namespace) == here]
            there: dict[str, str] = {}
            different: dict[str, str] = {}
            for endpoint in seen:
                node = endpoint.node_name, endpoint.node_namespace
                types = published_types(self, *node)
                found = {role.name: full_name(*node) for role in roles if role.known_by in types}
                # DDS matches nodes built from other message definitions, but their messages would be misread.
                (there if endpoint.topic_type_hash in definitions else different).update(found)
            self.linked |= there
            # A link needs the node, identified by its types, and a matched endpoint; endpoints of viewers do not count.
            matched = self._matched(topic) - self._watching(seen, topic, there)
            name, kind = self.resolve_topic_name(topic), description.TOPICS[topic]
            for role in [role for role in roles if role.name not in there] or roles[max(matched, 0) :]:
                other = f"; {different[role.name]} has another definition of {kind}" if role.name in different else ""
                missing.append(f"{role.name} ({name}{other})")
        return missing

    def node_in_role(self, role: NodeDescription) -> str | None:
        """Return the full name of the node in ``role`` in this graph, or None."""
        if role.name in self.linked:
            return self.linked[role.name]
        found = node_in_role(self, role)
        return full_name(*found) if found else None

    def log_waiting(self, missing: Sequence[str], decides: bool = False) -> None:
        """Log ``missing`` after 2 s, then every 10 s; from 10 s on as a warning if this node ``decides`` the start."""
        now = time.monotonic()
        if now < self._next_log:
            return
        self._next_log = now + LOG_INTERVAL
        words = "waiting for " + ", ".join(missing)
        if decides and now - self._made > LOG_INTERVAL:
            self.get_logger().warning(f"slow start, for {now - self._made:.0f} s {words}")
        else:
            self.get_logger().info(words)

    def publishers_of(self, topic: str) -> list[str]:
        """Return the full names of the nodes that publish ``topic``, one per endpoint."""
        return sorted(full_name(e.node_name, e.node_namespace) for e in self.get_publishers_info_by_topic(topic))

    def set_parameters_atomically(self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Set the parameters; the reason in the result states the step at which a change in flight takes effect."""
        self._changed = ""
        result = super().set_parameters_atomically(parameter_list)
        if result.successful:
            result.reason = self._changed
        return result

    def log_change(self, words: str) -> None:
        """Log ``words`` (a parameter change and its first step) and keep them for the reply to the request."""
        self._changed = words
        self.get_logger().info(words)

    def diagnosed(self, signals: Signals) -> bool:
        """Return whether diagnostics of this simulated second have been published."""
        return bool(signals.stamp[0] == self._diagnosed_second)

    def diagnose(self, signals: Signals, summary: str = "running", warning: bool = False, **values: object) -> None:
        """Publish ``summary`` and ``values`` as diagnostics, once per simulated second and for every ``warning``."""
        if self.diagnosed(signals) and not warning:
            return
        self._diagnosed_second = signals.stamp[0]
        values = {"step": signals.step, **values, **self.measured()}
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if warning else DiagnosticStatus.OK,
            name=f"{self.get_name()}: {self._task}",
            message=summary,
            hardware_id="hsv",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp.sec, message.header.stamp.nanosec = signals.stamp
        self._diagnostics.publish(message)

    def measured(self) -> dict[str, str]:
        """Return further values for the diagnostics, by name; empty unless overridden."""
        return {}

    def _watching(self, seen: Sequence[TopicEndpointInfo], topic: str, linked: Mapping[str, str]) -> int:
        """Return the number of viewers' endpoints in ``seen``: able to match ``topic``, of nodes not ``linked``."""
        strangers = [e for e in seen if full_name(e.node_name, e.node_namespace) not in linked.values()]
        pairs = [(STEP, e.qos_profile) if topic in self._outputs else (e.qos_profile, STEP) for e in strangers]
        return sum(
            endpoint.topic_type == description.TOPICS[topic]
            and qos_check_compatible(*pair)[0] is not QoSCompatibility.ERROR
            for endpoint, pair in zip(strangers, pairs, strict=True)
        )

    def _matched(self, topic: str) -> int:
        if topic in self._outputs:
            return int(self._outputs[topic].get_subscription_count())
        return int(self._inputs[topic].get_publisher_count())


class PeerNode(LockstepNode):
    """Any node of the graph but the plant: when the plant announces a run, the node announces that it is ready.

    The plant announces the end of the run; if it disappears without doing so, the run counts as broken off.
    """

    def __init__(self, role: NodeDescription, task: str) -> None:
        """Join the graph; the subclass must then call :meth:`hear_runs`."""
        super().__init__(role, task)
        self._run: Run | None = None
        self._announced = False
        self.over = False
        """Whether the announced run has ended."""
        self._ready = self.create_publisher(Ready, description.READY, LATCHED)
        # Subscribe before /hsv/run, so that the end of a run is received before the start of the next.
        self.create_subscription(VehicleState, description.LAST_STATE, self._on_last_state, LATCHED)

    def hear_runs(self, callback: Callable[[Any], None], raw: bool = False) -> None:
        """Subscribe to the plant's announcements of runs; with ``raw``, ``callback`` is called with their bytes.

        Call this after all other subscriptions whose earlier messages must be received before the announcement.
        """
        links = SubscriptionEventCallbacks(matched=self._on_plant)
        self._runs = self.create_subscription(Run, description.RUN, callback, LATCHED, event_callbacks=links, raw=raw)

    def start_run(self, run: Run) -> None:
        """Reset the node for a new run; overridden by subclasses."""

    def end_run(self, how: str) -> None:
        """Log how the run ended; subclasses may do more."""
        self.get_logger().info(how)

    @property
    def announced(self) -> Run | None:
        """The run for which this node has announced itself ready, or None."""
        return self._run if self._announced else None

    def poll(self) -> None:
        """Announce this node as ready for an announced run once its links match; until then log what is missing."""
        if self._announced:
            return
        if self._run is None:
            self.log_waiting([f"plant ({self._runs.topic_name})"])
        elif missing := self.missing_links():
            self.log_waiting(missing)
        else:
            self._announced = True
            self._ready.publish(Ready(node=self.role.name, run_id=self._run.run_id))
            self.get_logger().info(f"ready for {run_in_words(self._run)}")

    def wait_timeout(self) -> float:
        """Return the time (s) to the next poll, which is shorter until the links are matched."""
        return 0.25 if self._announced else LINK_CHECK

    def _on_run(self, run: Run) -> None:
        period = self.get_parameter("period").value if self.has_parameter("period") else run.period
        if run.interface_version != Run.INTERFACE_VERSION:
            version = f"interface version {run.interface_version} of the plant"
            self.fail(f"{version}: expected {Run.INTERFACE_VERSION}, as here", 2)
        elif period != run.period:
            self.fail(f"parameter period = {period}: expected the plant's, {run.period}", 2)
        else:
            self.start_run(run)
            self._run = run
            self._announced = self.over = False

    def _on_last_state(self, state: VehicleState) -> None:
        words = {VehicleState.RUNNING: "broken off by the plant", VehicleState.FINISHED: "finished"}
        how = words.get(state.status, "diverged")
        self._end(f"{how} at {step_in_words(state.step, self._run.period if self._run else 0.0)}")

    def _on_plant(self, info: QoSSubscriptionMatchedInfo) -> None:
        if info.current_count == 0:
            self._end("broken off, the plant is gone")

    def _end(self, how: str) -> None:
        """Handle the end of the run, once, when the plant announces it or disappears."""
        if self._run is not None and self._announced and not self.over:
            self.over = True
            self.end_run(f"run {short_id(self._run)} {how}")


def short_id(run: Run) -> str:
    """Return the first eight characters of the run's id, for display."""
    return str(run.run_id[:8])


def run_in_words(run: Run) -> str:
    """Return short id, number of steps and duration of a run as text."""
    return f"run {short_id(run)}: {run.last_step + 1} steps, {run.last_step * run.period:g} s"


def step_in_words(step: int, period: float) -> str:
    """Return the simulated time and number of a step as text; ``period`` is the control period (s)."""
    return f"t = {step * period:.2f} s, step {step}"
