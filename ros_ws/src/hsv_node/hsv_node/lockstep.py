"""Base of all nodes: parameters, links of the graph description, the ready barrier, diagnostics."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hsv_msgs.msg import Ready, Run

from hsv.graph import description
from hsv.graph.part_parameters import LOCKSTEP_PARAMETERS
from hsv_node.messages import message_class
from hsv_node.parameters import declare
from hsv_node.process import ProcessNode
from hsv_node.qos import LATCHED, STEP

SAY_AFTER = 2.0
"""Seconds of waiting for peers before this is said, and between saying it again."""

LINK_LOOK = 0.05
"""Seconds between looks at the links before they stand; each takes a millisecond from those that still start."""

WARN_AFTER = 10.0
"""Seconds after which whoever waits for all says it as a warning: slow, and going on."""


class LockstepNode(ProcessNode):
    """A node of the graph description that reacts to the messages of a step and never to timers."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        values = declare(self, LOCKSTEP_PARAMETERS)
        self.recorded, self.controller = bool(values["recorder"]), str(values["controller"])
        self._inputs: dict[str, Any] = {}
        self._outputs: dict[str, Any] = {}
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", STEP)
        self._diagnosed_second = -1
        self._made = time.monotonic()
        self._says_next = self._made + SAY_AFTER

    def create_step_subscription(self, topic: str, callback: Callable[[Any], None], raw: bool = False) -> None:
        """Subscribe a step topic of the graph description."""
        kind = message_class(description.TOPICS[topic])
        self._inputs[topic] = self.create_subscription(kind, topic, callback, STEP, raw=raw)

    def create_step_publisher(self, topic: str) -> Any:
        """Return the publisher of a step topic of the graph description."""
        self._outputs[topic] = self.create_publisher(message_class(description.TOPICS[topic]), topic, STEP)
        return self._outputs[topic]

    def missing_links(self) -> list[str]:
        """Return what this node still waits for, e.g. ``"tube_mpc (/hsv/nominal)"``; empty when all is matched."""
        missing = []
        expected: dict[str, int] = {}
        for topic, peer in description.links(self.get_name(), self.controller, self.recorded):
            expected[topic] = expected.get(topic, 0) + 1
            if topic in self._outputs:
                seen = self.get_subscriptions_info_by_topic(topic)
                matched = self._outputs[topic].get_subscription_count()
            else:
                seen = self.get_publishers_info_by_topic(topic)
                matched = self._inputs[topic].get_publisher_count()
            # Names say who is there, counts that the link itself stands: both are needed before the first message.
            if peer not in (endpoint.node_name for endpoint in seen) or matched < expected[topic]:
                missing.append(f"{peer} ({topic})")
        return missing

    def say_waiting(self, missing: Sequence[str], decides: bool = False) -> None:
        """Log now and then for whom this node waits; in the end as a warning if its waiting ``decides`` the start."""
        now = time.monotonic()
        if missing and now > self._says_next:
            self._says_next = now + SAY_AFTER
            words = "waiting for " + ", ".join(missing)
            if decides and now - self._made > WARN_AFTER:
                self.get_logger().warning(f"slow start, for {now - self._made:.0f} s {words}")
            else:
                self.get_logger().info(words)

    def diagnose(self, step_stamp: Any, summary: str = "running", warning: bool = False, **values: object) -> None:
        """Publish this node's diagnostics, once a simulated second and whenever there is a warning."""
        if step_stamp.sec == self._diagnosed_second and not warning:
            return
        self._diagnosed_second = step_stamp.sec
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if warning else DiagnosticStatus.OK,
            name=self.get_name(),
            message=summary,
            hardware_id="hsv",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = step_stamp
        self._diagnostics.publish(message)


class PeerNode(LockstepNode):
    """A node other than the plant: it announces itself ready to every run that the plant announces."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._run: Run | None = None
        self._announced = False
        self._ready = self.create_publisher(Ready, "/hsv/ready", LATCHED)
        self.create_subscription(Run, "/hsv/run", self._on_run, LATCHED)

    def start_run(self, run: Run) -> None:
        """Forget the run before; overridden by every node."""

    def poll(self) -> None:
        """Announce this node as ready as soon as all its links are matched; until then say for whom it waits."""
        if self._announced:
            return
        missing = self.missing_links()
        if self._run is not None and not missing:
            self._announced = True
            self._ready.publish(Ready(node=self.get_name(), run_id=self._run.run_id))
        else:
            self.say_waiting(missing or ["plant (/hsv/run)"])

    def wait_timeout(self) -> float:
        """Look at the links more often until they stand."""
        return 0.25 if self._announced else LINK_LOOK

    def _on_run(self, run: Run) -> None:
        period = self.get_parameter("period").value if self.has_parameter("period") else run.period
        if period != run.period:
            self.get_logger().fatal(f"parameter period = {period}: expected the plant's, {run.period}")
            self.finish(2)
            return
        self._run = run
        self._announced = False
        self.start_run(run)
