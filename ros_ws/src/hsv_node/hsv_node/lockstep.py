"""Base of all nodes: parameters, links of the graph description, the ready barrier, diagnostics."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hsv_msgs.msg import Ready, Run, VehicleState
from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import QoSSubscriptionMatchedInfo, SubscriptionEventCallbacks
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from hsv.bags import description
from hsv.bags.description import NodeDescription
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.base.errors import RunError
from hsv.control.controllers import class_place
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.flight.blocks import Signals
from hsv_node.middleware import LATCHED, STEP, message_class
from hsv_node.parameters import declare, refuse_unknown
from hsv_node.process import ProcessNode
from hsv_node.roles import full_name, node_in_role, published_types

FIRST_SAID_AFTER = 2.0
"""Seconds of waiting for peers before this is said."""

SAID_EVERY = 10.0
"""Seconds between repeated messages."""

LINK_LOOK = 0.05
"""Seconds between looks at the links before they stand; each takes a millisecond from those that still start."""

WARN_AFTER = 10.0
"""Seconds after which a node that waits for all others logs a warning."""


class LockstepNode(ProcessNode):
    """A node of the graph description that reacts to the messages of a step and never to timers.

    Its peers are known by what they publish, not by their names, which may be remapped as those of the topics may.

    Raises:
        RunError: Another node of this machine publishes its topics in the same domain and namespace.
        ParameterError: A wrong parameter, named; such as a ``controller`` that nobody knows.
    """

    def __init__(self, role: NodeDescription, task: str = "") -> None:
        """Join the graph.

        Args:
            role: Role of the node in the graph.
            task: Task named in its diagnostics, in a word or two.
        """
        super().__init__(role.name)
        self._task = task
        place = f"one {role.name} a domain and namespace (ROS_DOMAIN_ID, -r __ns:=)"
        self.claim_name(f"{place}, and another name for every other node (-r __node:=)")
        for topic in role.own_topics:
            self.claim(topic, place)
        if role.known_by:
            refuse_unknown(self, role.name, self.of_others)
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
        self._says_next = self._made + FIRST_SAID_AFTER
        self._changed = ""
        """Parameter that is being changed, and the step at which the change takes effect."""
        self._foreign = 0
        self._foreign_said = -SAID_EVERY
        self._links: dict[str, list[NodeDescription]] = {}
        self.linked: dict[str, str] = {}
        """Full names of the nodes at the other ends of the links, by role, as :meth:`missing_links` last saw them."""
        if role.known_by:
            for topic, peer in description.links(self.role, self.controller, self.recorded, self.estimator):
                self._links.setdefault(topic, []).append(peer)

    def create_step_subscription(self, topic: str, callback: Callable[[bytes], None]) -> None:
        """Subscribe to a step topic of the graph description; ``callback`` takes the bytes of a message."""

        def take(message: bytes) -> None:
            if self.exit_code is not None:
                return  # The node is shutting down; the reason has been logged.
            try:
                callback(message)
            except RunError as error:
                self.refuse_message(topic, error)

        kind = message_class(description.TOPICS[topic])
        self._inputs[topic] = self.create_subscription(kind, topic, take, STEP, raw=True)

    def refuse_message(self, topic: str, error: RunError) -> str:
        """Shut down because of a message that cannot be used; return what has been logged."""
        logged = f"{self.resolve_topic_name(topic)}: {error}"
        # Not raised: the executor would print a traceback.
        self.get_logger().fatal(logged)
        self.finish(1)
        return logged

    def create_step_publisher(self, topic: str) -> Callable[[bytes], None]:
        """Return the function that publishes the bytes of a message on a step topic of the graph description."""
        kind = description.TOPICS[topic]
        self._outputs[topic] = publisher = self.create_publisher(message_class(kind), topic, STEP)
        # Of the handle: before it, rclpy asks what it is given, and that takes half as long as to publish it.
        publish: Callable[[bytes], None] = publisher.handle.publish_raw
        return publish

    def links_are_counted(self) -> bool:
        """Return whether as many endpoints are matched as there are links: a fast check that does not identify them."""
        return all(self._matched(topic) >= len(roles) for topic, roles in self._links.items())

    def missing_links(self) -> list[str]:
        """Return what this node still waits for, e.g. ``"tube_mpc (/hsv/nominal)"``; empty when all is matched."""
        missing = []
        types_of: dict[tuple[str, str], set[str]] = {}
        self.linked = {}
        for topic, roles in self._links.items():
            publishers, subscriptions = (
                self.get_publishers_info_by_topic(topic),
                self.get_subscriptions_info_by_topic(topic),
            )
            name = self.resolve_topic_name(topic)
            seen, own = (subscriptions, publishers) if topic in self._outputs else (publishers, subscriptions)
            here = self.get_name(), self.get_namespace()
            definitions = [e.topic_type_hash for e in own if (e.node_name, e.node_namespace) == here]
            there: dict[str, str] = {}
            different: dict[str, str] = {}
            for endpoint in seen:
                node = endpoint.node_name, endpoint.node_namespace
                if node not in types_of:
                    types_of[node] = published_types(self, *node)
                found = {role.name: full_name(*node) for role in roles if role.known_by in types_of[node]}
                # What was built from other message files would be matched, and read as something else.
                (there if endpoint.topic_type_hash in definitions else different).update(found)
            self.linked |= there
            absent = [role for role in roles if role.name not in there]
            # Types say who is there, counts that the link itself stands: both are needed before the first message. Who
            # only watches counts for none of them.
            absent = absent or roles[max(self._matched(topic) - self._watching(seen, topic, there), 0) :]
            kind = description.TOPICS[topic]
            missing += [
                f"{role.name} ({name}"
                + (f"; {different[role.name]} has another definition of {kind})" if role.name in different else ")")
                for role in absent
            ]
        return missing

    def node_in_role(self, role: NodeDescription) -> str | None:
        """Return the full name of the node that plays ``role`` in this graph, None if there is none."""
        if role.name in self.linked:
            return self.linked[role.name]
        found = node_in_role(self, role)
        return full_name(*found) if found else None

    def say_waiting(self, missing: Callable[[], Sequence[str]], decides: bool = False) -> None:
        """Log from time to time for which nodes this one waits; as a warning if its waiting ``decides`` the start."""
        now = time.monotonic()
        if now < self._says_next:
            return
        self._says_next = now + SAID_EVERY
        words = "waiting for " + ", ".join(missing())
        if decides and now - self._made > WARN_AFTER:
            self.get_logger().warning(f"slow start, for {now - self._made:.0f} s {words}")
        else:
            self.get_logger().info(words)

    def publishers_of(self, topic: str) -> list[str]:
        """Return the full names of the nodes that publish ``topic``, one for each that does."""
        return sorted(
            full_name(endpoint.node_name, endpoint.node_namespace)
            for endpoint in self.get_publishers_info_by_topic(topic)
        )

    def say_foreign(self, topic: str, step: int, expected: int) -> None:
        """Log from time to time that messages arrive that no node of this graph should send."""
        self._foreign += 1
        now = time.monotonic()
        if now < self._foreign_said + SAID_EVERY:
            return
        self._foreign_said = now
        publishers = self.publishers_of(topic)
        self.get_logger().error(
            f"{self._inputs[topic].topic_name} of step {step}: expected {expected}, ignored ({self._foreign} so far; "
            f"published by {', '.join(publishers) or 'a node that is gone'})"
        )

    def set_parameters_atomically(self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Put into the result the step at which a change in flight takes effect."""
        self._changed = ""
        result = super().set_parameters_atomically(parameter_list)
        if result.successful:
            result.reason = self._changed
        return result

    def say_change(self, words: str) -> None:
        """Log a change in flight and the step at which it takes effect, and send the same as the reply."""
        self._changed = words
        self.get_logger().info(words)

    def diagnosis_due(self, signals: Signals) -> bool:
        """Return whether a simulated second has begun since the last diagnosis."""
        return signals.stamp[0] != self._diagnosed_second

    def diagnose(self, signals: Signals, summary: str = "running", warning: bool = False, **values: object) -> None:
        """Publish this node's diagnostics: once a simulated second, see :meth:`diagnosis_due`, and as a warning."""
        self._diagnosed_second = signals.stamp[0]
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if warning else DiagnosticStatus.OK,
            name=f"{self.get_name()}: {self._task}",
            message=summary,
            hardware_id="hsv",
            values=[KeyValue(key=key, value=str(value)) for key, value in ({"step": signals.step} | values).items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp.sec, message.header.stamp.nanosec = signals.stamp
        self._diagnostics.publish(message)

    def _watching(self, seen: Sequence[TopicEndpointInfo], topic: str, linked: Mapping[str, str]) -> int:
        """Return how many of the endpoints ``seen`` are of nodes that are not ``linked``, and matched all the same."""

        def ends(other: QoSProfile) -> tuple[QoSProfile, QoSProfile]:
            return (STEP, other) if topic in self._outputs else (other, STEP)

        return sum(
            full_name(endpoint.node_name, endpoint.node_namespace) not in linked.values()
            and endpoint.topic_type == description.TOPICS[topic]
            and qos_check_compatible(*ends(endpoint.qos_profile))[0] is not QoSCompatibility.ERROR
            for endpoint in seen
        )

    def _matched(self, topic: str) -> int:
        if topic in self._outputs:
            return int(self._outputs[topic].get_subscription_count())
        return int(self._inputs[topic].get_publisher_count())


class PeerNode(LockstepNode):
    """A node other than the plant: it announces itself ready to every run that the plant announces.

    How the run ended it learns from the plant; a plant that is gone without a word has broken it off.
    """

    def __init__(self, role: NodeDescription, task: str = "") -> None:
        super().__init__(role, task)
        self._run: Run | None = None
        self._announced = self._over = False
        self._ready = self.create_publisher(Ready, description.READY, LATCHED)
        # Before the run, so that the end of one is heard before the beginning of the next.
        self.create_subscription(VehicleState, description.LAST_STATE, self._on_last_state, LATCHED)
        links = SubscriptionEventCallbacks(matched=self._on_plant)
        self._runs = self.create_subscription(Run, description.RUN, self._on_run, LATCHED, event_callbacks=links)

    def start_run(self, run: Run) -> None:
        """Forget the run before; overridden by every node."""

    def end_run(self, how: str) -> None:
        """Say how the run ended; overridden where there is more to say."""
        self.get_logger().info(how)

    @property
    def announced(self) -> Run | None:
        """The run that this node has announced itself ready for, if there is one."""
        return self._run if self._announced else None

    def missing(self) -> list[str]:
        """Return what this node waits for before it is ready; overridden where that is more than links."""
        return self.missing_links()

    def poll(self) -> None:
        """Announce this node as ready as soon as all its links are matched; until then log which peers it waits for."""
        if self._announced:
            return
        if self._run is not None and self.links_are_counted() and not self.missing():
            self._announced = True
            self._ready.publish(Ready(node=self.role.name, run_id=self._run.run_id))
            self.get_logger().info(f"ready for {run_in_words(self._run)}")
        else:
            self.say_waiting(lambda: self.missing() or [f"plant ({self._runs.topic_name})"])

    def wait_timeout(self) -> float:
        """Check the links more often until they are connected."""
        return 0.25 if self._announced else LINK_LOOK

    def _on_run(self, run: Run) -> None:
        if run.interface_version != Run.INTERFACE_VERSION:
            self.get_logger().fatal(
                f"interface version {run.interface_version} of the plant: expected {Run.INTERFACE_VERSION}, as here"
            )
            self.finish(2)
            return
        period = self.get_parameter("period").value if self.has_parameter("period") else run.period
        if period != run.period:
            self.get_logger().fatal(f"parameter period = {period}: expected the plant's, {run.period}")
            self.finish(2)
            return
        self._run = run
        self._announced = self._over = False
        self.start_run(run)

    def _on_last_state(self, state: VehicleState) -> None:
        if state.status == VehicleState.RUNNING:
            how = "broken off by the plant"
        else:
            how = "finished" if state.status == VehicleState.FINISHED else "diverged"
        self._end(f"{how} at {step_in_words(state.step, self._run.period if self._run else 0.0)}")

    def _on_plant(self, info: QoSSubscriptionMatchedInfo) -> None:
        if info.current_count == 0:
            self._end("broken off, the plant is gone")

    def _end(self, how: str) -> None:
        """Note the end of the run that this node is ready for, once: the plant says it, and then is gone."""
        if self._run is not None and self._announced and not self._over:
            self._over = True
            self.end_run(f"run {short_id(self._run)} {how}")


def short_id(run: Run) -> str:
    """Return a prefix of the run's id that distinguishes it from others, for display."""
    return str(run.run_id[:8])


def run_in_words(run: Run) -> str:
    """Return which run this is, and how long it will be."""
    return f"run {short_id(run)}: {run.last_step + 1} steps, {run.last_step * run.period:g} s"


def step_in_words(step: int, period: float) -> str:
    """Return time and step in words."""
    return f"t = {step * period:.2f} s, step {step}"
