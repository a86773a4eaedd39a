"""The player node: republishes a bag at the recorded pace or another one, for a viewer or a node under test."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import remove_ros_args
from rosbags.interfaces import Qos, QosDurability, QosReliability

from hsv.bags.description import CLOCK, PLANT, RECORDER, TOPICS
from hsv.bags.reader import Bag
from hsv.base.errors import ParameterError
from hsv_node.lockstep import LOG_INTERVAL
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, installed_class
from hsv_node.parameters import refuse_unknown
from hsv_node.process import ProcessNode

EXCLUSIVE = (*TOPICS, *PLANT.announces, *RECORDER.announces)
"""Topics that only one node of a graph may publish."""


class PlayerNode(ProcessNode):
    """A node that publishes the recorded bytes of a bag; messages of equal simulated time are published together."""

    def __init__(self, bag: Bag, topics: Sequence[str], rate: float, delay: float) -> None:
        """Create the publishers and read the messages.

        Args:
            bag: Bag to play.
            topics: Topics to publish, by their names in the bag.
            rate: Ratio of simulated to wall time.
            delay: Wall time (s) before the first message, for subscribers to discover the player.
        """
        # Use the namespace of the bag, so that remapping the namespace of the player also moves the topics.
        super().__init__("player", bag.namespace)
        refuse_unknown(self, "")
        self._rate = rate
        exclusive = {bag.roles.get(role) for role in EXCLUSIVE}
        self._outputs: dict[str, Publisher] = {}
        for topic in topics:
            name = _relative(bag, topic)
            if topic in exclusive:
                # A running graph would take the messages for its own.
                self.claim(name, "others to play, or a place of their own (ROS_DOMAIN_ID, --namespace)")
            kind = installed_class(topic, bag.topics[topic].type)
            self._outputs[topic] = self.create_publisher(kind, name, _profile(bag.topics[topic].qos))
        self._instants = _instants(bag, topics)
        self._next = 0
        self._begins = time.monotonic() + delay

    def poll(self) -> None:
        """Publish the messages that are due; after the last one, end once the subscribers have received it."""
        while self._next < len(self._instants) and self._delay() <= 0.0:
            for topic, data in self._instants[self._next][1]:
                self._outputs[topic].publish(data)
            self._next += 1
        if self._next >= len(self._instants):
            self._end()

    def wait_timeout(self) -> float:
        """Return the wall time (s) to the next poll, at most 0.25 s."""
        return min(max(self._delay(), 0.0), 0.25)

    def _delay(self) -> float:
        """Return the wall time (s) until the next message is due."""
        if self._next >= len(self._instants):
            return 0.0
        played = (self._instants[self._next][0] - self._instants[0][0]) * 1e-9 / self._rate
        return self._begins + played - time.monotonic()

    def _end(self) -> None:
        """Finish if all subscribers have received everything, else log the slow topics. DDS drops hung subscribers."""
        slow = [t for t, p in self._outputs.items() if not p.wait_for_all_acked(Duration(seconds=0.25))]
        if not slow:
            self.finish(0)
        else:
            words = "waiting for slow subscribers of " + ", ".join(slow)
            self.get_logger().info(words, throttle_duration_sec=LOG_INTERVAL)


def _instants(bag: Bag, topics: Sequence[str]) -> list[tuple[int, list[tuple[str, bytes]]]]:
    """Return the instants (ns) in order, each with its messages (topic, bytes); step topics last, in recorded order."""
    gathered: dict[int, list[tuple[str, bytes]]] = {}
    order = [bag.name_of(role) for role in TOPICS]
    for topic in sorted(topics, key=lambda name: order.index(name) if name in order else -1):
        for instant, data in bag.messages(topic):
            gathered.setdefault(instant, []).append((topic, data))
    return sorted(gathered.items())


def _relative(bag: Bag, topic: str) -> str:
    """Return a topic's name relative to the bag's namespace; one outside it, or global like ``/rosout``, is kept."""
    own = bag.namespace.rstrip("/") + "/"
    role = next((role for role, name in bag.roles.items() if name == topic), "")
    return topic if role.startswith("/") or not topic.startswith(own) else topic.removeprefix(own)


def _profile(qos: Qos) -> QoSProfile:
    reliable, latched = qos.reliability is QosReliability.RELIABLE, qos.durability is QosDurability.TRANSIENT_LOCAL
    return QoSProfile(
        depth=max(qos.depth, LATCHED.depth if latched else 1),  # rosbag2 records 0 if the depth was unknown
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def main(args: Sequence[str] | None = None) -> int:
    """Run the player node."""
    words = remove_ros_args(list(sys.argv if args is None else args))[1:]
    parser = argparse.ArgumentParser(prog="player", description="Republish a bag.")
    parser.add_argument("bag", type=Path, help="bag directory, or its .mcap file")
    parser.add_argument("--rate", type=float, default=1.0, help="pace: 1 as recorded, 10 ten times as fast")
    parser.add_argument("--topics", nargs="+", default=[], help="topics to publish, and the clock; default: all")
    parser.add_argument("--no-clock", action="store_true", help="do not publish /clock")
    parser.add_argument(
        "--delay", type=float, default=1.0, help="wall time (s) that subscribers get to discover the player"
    )
    options = parser.parse_args(words)

    def build() -> PlayerNode:
        if not 0.0 < options.rate < math.inf:
            raise ParameterError(f"rate = {options.rate}: expected a finite number above zero")
        if not 0.0 <= options.delay < math.inf:
            raise ParameterError(f"delay = {options.delay}: expected a finite number (seconds), not below zero")
        bag = Bag(options.bag)
        topics = {bag.track(topic).topic: None for topic in options.topics or bag.topics}
        if not options.no_clock and CLOCK in bag.roles:
            topics[bag.roles[CLOCK]] = None
        if options.no_clock:
            topics.pop(bag.name_of(CLOCK), None)
        return PlayerNode(bag, list(topics), options.rate, options.delay)

    return run_node(build, "player", args, own_arguments=True)
