"""The recorder node: writes every message of a run to an MCAP bag and confirms the written steps to the plant."""

from __future__ import annotations

import datetime
import mimetypes
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from hsv_msgs.msg import Ready, RecorderProgress, Reference, Run, VehicleState
from rclpy.serialization import deserialize_message

from hsv.bags.definitions import definition, type_hash
from hsv.bags.description import (
    LATCHED_TOPICS,
    NOMINAL_TRAJECTORY,
    OTHER_TOPICS,
    READY,
    RECORDER,
    RECORDER_PROGRESS,
    REFERENCE,
    RUN,
    STATE,
    TOPICS,
    TRANSIENT_LOCAL,
    controller_node,
    graph,
    step_topics,
)
from hsv.bags.infrastructure_parameters import RECORDER_PARAMETERS
from hsv.bags.messages import StepMessages, stamp_in
from hsv.bags.metadata import Topic, usual_qos
from hsv.bags.roles import naming
from hsv.bags.writer import BagWriter
from hsv.base.errors import ParameterError
from hsv.flight.blocks import Signals
from hsv_bringup.flow_executor import BatchExecutor
from hsv_bringup.peer_parameters import PeerParameters
from hsv_node.lockstep import LOG_INTERVAL, PeerNode
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, STEP, message_class
from hsv_node.parameters import declare

CONFIRMATION_INTERVAL = 50
"""Steps between confirmations: a confirmation of every step would halve the speed of the loop."""


class RecorderNode(PeerNode):
    """A node that writes the messages of a step once all have arrived, in a fixed order, whichever arrived first."""

    def __init__(self) -> None:
        super().__init__(RECORDER, "bag")
        values = declare(self, RECORDER_PARAMETERS)
        utc = datetime.datetime.now(datetime.UTC).strftime("%Y%m%dT%H%M%SZ")
        self._directory = Path(values["bag.directory"] or f"bags/run_{utc}")
        self._last_step = 0
        self._now = 0
        self._complete = -1
        self._nanoseconds_per_step = 0
        self._pending: dict[int, dict[str, bytes]] = {}
        self._attachments = [Path(name) for name in values["bag.attachments"] if name]
        for path in self._attachments:
            if not path.is_file():
                raise ParameterError(f"parameter bag.attachments = {str(path)!r}: expected an existing file")
        self._custom_data = dict(pair.split("=", 1) for pair in values["bag.custom_data"] if "=" in pair)
        recorded = {topic: TOPICS[topic] for topic in step_topics(self.controller)}
        self._kinds = recorded | OTHER_TOPICS
        self._names = {topic: self.resolve_topic_name(topic) for topic in self._kinds}
        self._begin_bag()
        self._asks = not {"design.yaml", "scenario.yaml"} <= {path.name for path in self._attachments}
        """Whether to request the parameters from the nodes, because no files with them were given as attachments."""
        self._peers: PeerParameters | None = None
        self._order = tuple(self._names[topic] for topic in recorded)
        self._stale: set[str] = set()
        """Topics whose next messages belong to a run that was reset."""
        self._held: list[tuple[str, bytes]] = []
        """Topics and bytes of announcements for a run that the plant has not announced to this node yet."""
        self._referenced = False
        """Whether the first reference of the run has arrived."""
        self._state_messages, self._signals = StepMessages(STATE), Signals()
        for topic, name in zip(recorded, self._order, strict=True):
            self.create_step_subscription(topic, partial(self._on_step_message, name))
        for topic, kind in OTHER_TOPICS.items():
            if topic != RUN:
                profile = LATCHED if topic in LATCHED_TOPICS else STEP
                callback = partial(self._on_other_message, topic)
                self.create_subscription(message_class(kind), topic, callback, profile, raw=True)
        # Last, so that messages of a run that was reset are received before the run that replaces it is announced.
        self.hear_runs(self._on_raw_run, raw=True)
        self._progress = self.create_publisher(RecorderProgress, RECORDER_PROGRESS, STEP)

    def _begin_bag(self) -> None:
        custom_data = self._custom_data | naming(self._names, self.get_namespace())
        self.bag = BagWriter(self._directory, custom_data=custom_data)
        for path in self._attachments:
            self._attach(path.name, path.read_bytes())
        for topic, kind in self._kinds.items():
            latched = topic in TRANSIENT_LOCAL
            qos = usual_qos(LATCHED.depth if latched else STEP.depth, latched=latched)
            self.bag.add_topic(Topic(self._names[topic], kind, definition(kind), type_hash(kind), qos))
        self.get_logger().info(f"recording to {self.bag.directory}")

    def _keep_reset_run(self) -> None:
        """Close and rename the bag of a run that was reset, and begin a new bag."""
        self.close()
        numbered = (self._directory.with_name(f"{self._directory.name}_reset_{number}") for number in count(1))
        kept = next(path for path in numbered if not path.exists())
        self._directory.rename(kept)
        self.get_logger().info(f"the run was reset; its bag is now {kept}")
        self._pending.clear()
        self._now, self._complete, self._stale = 0, -1, {*self._order}
        self._begin_bag()

    def start_run(self, run: Run) -> None:
        """Prepare to record a new run: begin a new bag after a reset, otherwise fail if the bag has steps already."""
        if self._run is not None and not self.over and len(self.publishers_of(RUN)) == 1:
            self._keep_reset_run()
        elif self._complete >= 0:
            self.fail(
                "a new run was announced: expected one recorder per run, "
                "and a separate ROS_DOMAIN_ID or namespace for simultaneous runs"
            )
            return
        self._peers = None
        self.bag.add_custom_data({"run_id": run.run_id})
        self._last_step = run.last_step
        self._nanoseconds_per_step = round(run.period * 1e9)

    def end_run(self, how: str) -> None:
        """Log how the run ended and, if the graph was started by hand, that Ctrl-C closes the bag."""
        super().end_run(f"{how}{'; Ctrl-C closes the bag' if self._asks else ''}")

    def missing_links(self) -> list[str]:
        """Return the missing links and, in a run started by hand, the nodes whose parameters are not known yet."""
        missing = super().missing_links()
        if missing or self._run is None or not self._asks:
            return missing
        if self._peers is None:
            # Every node publishes something that is recorded, so that all nodes are linked.
            asked = [node.name for node in graph(self.controller) if not node.foreign]
            self._peers = PeerParameters(self, {role: name for role, name in self.linked.items() if role in asked})
        silent = self._peers.silent()
        if not silent:
            self._keep_parameters(self._run, self._peers.values)
        missing = [f"{role} ({service})" for role, service in silent.items()]
        if missing:
            self.log_waiting(missing, decides=True)
        return missing

    def _keep_parameters(self, run: Run, values: dict[str, dict[str, Any]]) -> None:
        # Imported only here: the parameter tables load slowly, and a prepared run does not need them.
        from hsv.bags.parameter_sections import disagreements
        from hsv.control.design import digest
        from hsv.graph.preparation import provenance, recorded_files

        for words in disagreements(values):
            self.get_logger().warning(words)
        flown = controller_node(self.controller)
        design = values[(NOMINAL_TRAJECTORY if flown.foreign else flown).name]
        for name, text in recorded_files(values, design).items():
            self._attach(name, text.encode())
        origin = provenance(self.controller, design.get("design.name", ""), digest(design), run.seed)
        self.bag.add_custom_data(origin)

    def _attach(self, name: str, data: bytes) -> None:
        self.bag.attach(name, mimetypes.guess_type(name)[0] or "text/plain", data)

    def _on_step_message(self, topic: str, data: bytes) -> None:
        stamp = stamp_in(data)
        if topic in self._stale:
            if stamp:
                return
            self._stale.discard(topic)
        if stamp <= self._now and self._complete >= 0:
            # DDS keeps the order of a topic: the sender does not belong to this graph.
            self.get_logger().error(
                f"{topic} at {stamp * 1e-9:.2f} s: is written already, ignored", throttle_duration_sec=LOG_INTERVAL
            )
            return
        messages = self._pending.setdefault(stamp, {})
        messages[topic] = data
        if len(messages) < len(self._order):
            return
        del self._pending[stamp]
        for topic in self._order:
            self.bag.write(topic, stamp, messages[topic])
        self._now = stamp
        self._complete = round(stamp / self._nanoseconds_per_step)
        self._state_messages.unpack(messages[self._names[STATE]], self._signals)
        final = self._complete >= self._last_step or self._signals.status != VehicleState.RUNNING
        if self._complete % CONFIRMATION_INTERVAL == 0 or final:
            # Flush first, so that confirmed steps survive the end of this process.
            self.bag.flush()
            self._progress.publish(RecorderProgress(step=self._complete))

    def _on_raw_run(self, data: bytes) -> None:
        """Begin the announced run, and write the announcements for it that arrived earlier."""
        held, self._held, self._referenced = self._held, [], False
        self._on_run(deserialize_message(data, Run))
        self._on_other_message(RUN, data)
        for topic, announced in held:
            self._on_other_message(topic, announced)

    def _on_other_message(self, topic: str, data: bytes) -> None:
        if self._is_of_this_run(topic, data):
            self.bag.write(self._names[topic], self._now, data)
        else:
            self._held.append((topic, data))

    def _is_of_this_run(self, topic: str, data: bytes) -> bool:
        """Return False for a ready message or a reference of another run than the announced one, otherwise True."""
        if topic == READY:
            return self._run is not None and deserialize_message(data, Ready).run_id == self._run.run_id
        if topic != REFERENCE:
            return True
        # A reference does not name its run, but the first reference of every run applies from step 0 on.
        reference = deserialize_message(data, Reference)
        first = reference.step == 0 and reference.status == Reference.FLOWN
        of_this_run = self._run is not None and not (first and self._referenced)
        self._referenced |= first and of_this_run
        return of_this_run

    def close(self) -> None:
        """Write the messages of incomplete steps and the announcements held back, and finish the bag."""
        for stamp in sorted(self._pending):
            for topic in sorted(self._pending[stamp], key=self._order.index):
                self.bag.write(topic, stamp, self._pending[stamp][topic])
        for topic, data in self._held:
            self.bag.write(self._names[topic], self._now, data)
        self.bag.close()
        self.get_logger().info(f"closed the bag {self.bag.directory}: {self._complete + 1} steps")


main = partial(run_node, RecorderNode, "recorder", executor_class=BatchExecutor)
