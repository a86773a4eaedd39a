"""One process of the ring: answers with messages of full size as soon as its inputs have come, and computes nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.node import Node

from hsv.bags import description
from hsv.bags.definitions import definition, type_hash
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import BagWriter
from hsv_node.middleware import STEP, message_class

_CONTROLLER = description.TUBE_MPC.name

_FILLED = {
    description.FILTERED_STATE: {"filter_state": [0.0] * 2},
    description.TUBE_STATUS: {"error": [0.0] * 7, "tube_centre": [0.0] * 7, "tube_half_width": [0.0] * 7},
}
"""Arrays with as many elements as in a flight of Case 1."""


class RingNode:
    """A process of the graph description without its work."""

    def __init__(self, role: str, laps: int) -> None:
        """Create publishers and subscriptions of ``role``, for so many laps."""
        self.ros = Node(role)
        self.finished = False
        self.lap = 0
        self._laps = laps
        self._role = next(node for node in description.graph() if node.name == role)
        self._came = 0
        self._outputs = [(topic, self._publisher(topic), self._message(topic)) for topic in self._role.publishes]
        raw = self._role is description.RECORDER
        self.inputs = [
            self.ros.create_subscription(self._kind(topic), topic, self._callback(topic), STEP, raw=raw)
            for topic in self._role.subscribes
        ]

    def matched(self) -> bool:
        """Return whether all links of the graph description are connected."""
        links = description.links(self._role, _CONTROLLER, True)
        counts = {topic: publisher.get_subscription_count() for topic, publisher, _ in self._outputs}
        inputs = zip(self._role.subscribes, self.inputs, strict=True)
        counts |= {topic: subscription.get_publisher_count() for topic, subscription in inputs}
        return all(count >= sum(topic == linked for linked, _ in links) for topic, count in counts.items())

    def publish(self) -> None:
        """Publish the messages of this process for a step."""
        for topic, publisher, message in self._outputs:
            if topic != description.CLOCK:
                message.step = self.lap
            publisher.publish(message)

    def receive(self, message: Any) -> None:
        """Take an input; publish when all inputs of a step have arrived."""
        self._came += 1
        if self._came < len(self.inputs):
            return
        self._came = 0
        self.lap += 1
        self.finished = self.lap == self._laps
        if self._role is not description.PLANT or not self.finished:
            self.publish()

    def close(self) -> None:
        """Overridden where something must be saved."""

    def _callback(self, topic: str) -> Callable[[Any], None]:
        return self.receive

    def _publisher(self, topic: str) -> Any:
        return self.ros.create_publisher(self._kind(topic), topic, STEP)

    @staticmethod
    def _kind(topic: str) -> Any:
        return message_class(description.TOPICS[topic])

    def _message(self, topic: str) -> Any:
        return self._kind(topic)(**_FILLED.get(topic, {}))


class Recorder(RingNode):
    """Writes all messages to a bag, as they come."""

    def __init__(self, laps: int, bag: Path) -> None:
        super().__init__(description.RECORDER.name, laps)
        self._bag = BagWriter(bag)
        for topic, kind in description.TOPICS.items():
            self._bag.add_topic(Topic(topic, kind, definition(kind), type_hash(kind), Qos(depth=STEP.depth)))

    def _callback(self, topic: str) -> Callable[[Any], None]:
        return partial(self._write, topic)

    def _write(self, topic: str, data: bytes) -> None:
        self._bag.write(topic, self.lap, data)
        self.receive(data)

    def close(self) -> None:
        """Finish the bag."""
        self._bag.close()
