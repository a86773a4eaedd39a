"""The bare ring, a benchmark: processes that exchange the messages of the graph and compute nothing.

``hsv bench`` starts them. A process prints ``ready`` when its links are matched. A line on standard input starts the
plant, which prints the total time (s) of the laps. Every process ends after another line on standard input.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from hsv.bags import description
from hsv.bags.definitions import definition, type_hash
from hsv.bags.metadata import Topic, usual_qos
from hsv.bags.writer import BagWriter
from hsv_node.middleware import STEP, message_class

_FILLED = {
    description.FILTERED_STATE: {"filter_state": [0.0] * 2},
    description.TUBE_STATUS: {"error": [0.0] * 7, "tube_centre": [0.0] * 7, "tube_half_width": [0.0] * 7},
}
"""Array fields with as many elements as in Case 1, by topic."""


class RingNode:
    """A node of the graph that computes nothing and publishes when all inputs of a step have arrived.

    Args:
        role: The name of the node in the graph.
        laps: The number of laps to run; in a lap, every message of one step is exchanged.
        bag: A new directory, to which the recorder writes its inputs.
    """

    def __init__(self, role: str, laps: int, bag: Path) -> None:
        self.ros = Node(role)
        self.lap = 0
        self.laps = laps
        self._arrived = 0
        self.role = next(node for node in description.graph() if node.name == role)
        kinds = {topic: message_class(kind) for topic, kind in description.TOPICS.items()}
        self._bag = BagWriter(bag) if self.role is description.RECORDER else None
        self._outputs = [
            (topic, self.ros.create_publisher(kinds[topic], topic, STEP), kinds[topic](**_FILLED.get(topic, {})))
            for topic in self.role.publishes
        ]
        self._inputs = {}
        for topic in self.role.subscribes:
            callback, raw = partial(self._receive, topic), self._bag is not None
            self._inputs[topic] = self.ros.create_subscription(kinds[topic], topic, callback, STEP, raw=raw)
            if self._bag:
                kind = description.TOPICS[topic]
                self._bag.add_topic(Topic(topic, kind, definition(kind), type_hash(kind), usual_qos(STEP.depth)))

    def matched(self) -> bool:
        """Return whether all links of the graph description are matched."""
        links = [topic for topic, _ in description.links(self.role, description.TUBE_MPC.name, True)]
        counts = {topic: publisher.get_subscription_count() for topic, publisher, _ in self._outputs}
        counts |= {topic: subscription.get_publisher_count() for topic, subscription in self._inputs.items()}
        return all(count >= links.count(topic) for topic, count in counts.items())

    def publish(self) -> None:
        """Publish the messages of this node for the current lap."""
        for topic, publisher, message in self._outputs:
            if topic != description.CLOCK:
                message.step = self.lap
            publisher.publish(message)

    def _receive(self, topic: str, message: Any) -> None:
        if self._bag:
            self._bag.write(topic, self.lap, message)
        self._arrived = (self._arrived + 1) % len(self._inputs)
        if self._arrived == 0:
            self.lap += 1
            if self.role is not description.PLANT or self.lap < self.laps:
                self.publish()


def main(args: Sequence[str] | None = None) -> int:
    """Run one process of the ring."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", help="a node of the graph")
    parser.add_argument("laps", type=int)
    parser.add_argument("bag", type=Path, help="bag of the recorder, a new directory")
    arguments = parser.parse_args(args)
    rclpy.init(args=[])
    node = RingNode(arguments.role, arguments.laps, arguments.bag)
    executor = EventsExecutor()
    executor.add_node(node.ros)
    while not node.matched():
        time.sleep(0.02)
    print("ready", flush=True)
    starts = node.role is description.PLANT
    if starts:
        sys.stdin.readline()
    started = time.perf_counter()
    if starts:
        node.publish()
    while node.lap < node.laps:
        executor.spin_once(timeout_sec=0.25)
    if starts:
        print(time.perf_counter() - started, flush=True)
    sys.stdin.readline()
    return 0
