"""The player node: republishes a bag at its own pace, faster, or step by step, for a viewer or a node under test."""

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
from std_srvs.srv import Trigger

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

    def __init__(self, bag: Bag, topics: Sequence[str], rate: float, paused: bool, delay: float) -> None:
        """Prepare to play.

        Args:
            bag: Bag to play.
            topics: Topics to publish, by their names in the bag.
            rate: Simulated over wall time.
            paused: Whether to begin paused.
            delay: Wall time (s) before the first message, for subscribers to discover the player.
        """
        # In the namespace of the bag, so that a remapping of the player's own moves its topics as well.
        super().__init__("player", bag.namespace)
        refuse_unknown(self, "")
        self._rate = rate
        self._paused = paused
        exclusive = {bag.roles.get(role) for role in EXCLUSIVE}
        self._outputs: dict[str, Publisher] = {}
        for topic in topics:
            name = _relative(bag, topic)
            if topic in exclusive:
                # A graph that flies would take the messages for its own.
                self.claim(name, "others to play, or a place of their own (ROS_DOMAIN_ID, --namespace)")
            kind = installed_class(topic, bag.topics[topic].type)
            self._outputs[topic] = self.create_publisher(kind, name, _profile(bag.topics[topic].qos))
        self._instants = _instants(bag, topics)
        self._next = 0
        self._begins = time.monotonic() + delay
        self._anchor: tuple[float, int] | None = None
        """Wall time (s) and simulated time (ns) at the start of the current pace."""
        self.create_service(Trigger, "~/pause", self._pause)
        self.create_service(Trigger, "~/resume", self._resume)
        self.create_service(Trigger, "~/step", self._step)

    def poll(self) -> None:
        """Publish the messages that are due; end after the last one."""
        while not self._paused and self._next < len(self._instants) and self._delay() <= 0.0:
            self._publish()
        if self._next >= len(self._instants):
            self._end()

    def wait_timeout(self) -> float:
        """Return the time (s) to the next message."""
        return 0.25 if self._paused else min(max(self._delay(), 0.0), 0.25)

    def _delay(self) -> float:
        now = time.monotonic()
        if now < self._begins:
            return self._begins - now
        if self._next >= len(self._instants):
            return 0.0
        instant = self._instants[self._next][0]
        if self._anchor is None:
            self._anchor = now, instant
        return self._anchor[0] + (instant - self._anchor[1]) * 1e-9 / self._rate - now

    def _end(self) -> None:
        """End when all subscribers have received everything; DDS itself drops one that is gone or hangs."""
        slow = [t for t, p in self._outputs.items() if not p.wait_for_all_acked(Duration(seconds=0.25))]
        if not slow:
            self.finish(0)
        else:
            words = "waiting for slow subscribers of " + ", ".join(slow)
            self.get_logger().info(words, throttle_duration_sec=LOG_INTERVAL)

    def _publish(self) -> None:
        for topic, data in self._instants[self._next][1]:
            self._outputs[topic].publish(data)
        self._next += 1

    def _pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._paused = True
        return self._answer(response)

    def _resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._paused = False
        self._anchor = None
        return self._answer(response)

    def _step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if not self._paused:
            return Trigger.Response(message="playing: pause first")
        if self._next >= len(self._instants):
            return Trigger.Response(message="at the end, nothing is left to publish")
        self._publish()
        return self._answer(response)

    def _answer(self, response: Trigger.Response) -> Trigger.Response:
        time = self._instants[self._next - 1][0] * 1e-9
        played = f"played up to t = {time:.3f} s" if self._next else "nothing played"
        response.success, response.message = True, f"{'paused' if self._paused else 'playing'}, {played}"
        return response


def _instants(bag: Bag, topics: Sequence[str]) -> list[tuple[int, list[tuple[str, bytes]]]]:
    """Return the messages by simulated time (ns); at equal times they have the order of a recorded step."""
    gathered: dict[int, list[tuple[str, bytes]]] = {}
    order = [bag.name_of(role) for role in TOPICS]
    for topic in sorted(topics, key=lambda name: order.index(name) if name in order else -1):
        for instant, data in bag.messages(topic):
            gathered.setdefault(instant, []).append((topic, data))
    return sorted(gathered.items())


def _relative(bag: Bag, topic: str) -> str:
    """Return the name of a topic relative to the namespace of its bag; topics outside it keep their names."""
    own = bag.namespace.rstrip("/") + "/"
    role = next((role for role, name in bag.roles.items() if name == topic), "")
    return topic if role.startswith("/") or not topic.startswith(own) else topic.removeprefix(own)


def _profile(qos: Qos) -> QoSProfile:
    reliable, latched = qos.reliability is QosReliability.RELIABLE, qos.durability is QosDurability.TRANSIENT_LOCAL
    return QoSProfile(
        depth=max(qos.depth, LATCHED.depth if latched else 1),  # rosbag2 records 0 where it was not known
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
    parser.add_argument("--paused", action="store_true", help="begin paused: call /player/step or /player/resume")
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
        return PlayerNode(bag, list(topics), options.rate, options.paused, options.delay)

    return run_node(build, "player", args, own_arguments=True)
