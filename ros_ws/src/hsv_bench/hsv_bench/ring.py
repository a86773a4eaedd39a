"""The ring: bare processes that pass messages on as the graph does; ``hsv bench`` starts them.

A process says ``ready`` when its links stand; the one with the plant starts on a line on standard input and says in the
end how many seconds the laps took. Standard input closed ends a process.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation

from hsv.bags import description
from hsv_bench.ring_node import Recorder, RingNode

LOOPS = ("events", "wait_set", "ordered")


def spin_events(nodes: Sequence[RingNode]) -> None:
    """Let the EventsExecutor of rclpy call."""
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node.ros)
    while not all(node.finished for node in nodes):
        executor.spin_once(timeout_sec=0.25)


def spin_wait_set(nodes: Sequence[RingNode]) -> None:
    """Wait on a wait set and take, without any executor: the least that rclpy can do between processes."""
    inputs = [(node, subscription) for node in nodes for subscription in node.inputs]
    handle = rclpy.get_default_context().handle
    assert handle is not None
    with handle:
        wait_set = rclpy_implementation.WaitSet(len(inputs), 0, 0, 0, 0, 0, handle)
        while not all(node.finished for node in nodes):
            wait_set.clear_entities()
            indices = [wait_set.add_subscription(subscription.handle) for _, subscription in inputs]
            wait_set.wait(250_000_000)
            for index, (node, subscription) in zip(indices, inputs, strict=True):
                if wait_set.is_ready("subscription", index):
                    _take(node, subscription)


def spin_ordered(nodes: Sequence[RingNode]) -> None:
    """Take in the order of the data flow: the least that rclpy can do within one process."""
    while not all(node.finished for node in nodes):
        for node in nodes:
            for subscription in node.inputs:
                _take(node, subscription)


def _take(node: RingNode, subscription: object) -> None:
    taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)  # type: ignore[attr-defined]
    if taken is not None:
        subscription.callback(taken[0])  # type: ignore[attr-defined]


def main(args: Sequence[str] | None = None) -> int:
    """Run one process of the ring, or all of it in one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", help="a node of the graph, or all")
    parser.add_argument("laps", type=int)
    parser.add_argument("loop", choices=LOOPS)
    parser.add_argument("bag", type=Path, help="bag of the recorder, a new directory")
    arguments = parser.parse_args(args)
    names = [node.name for node in description.graph()]
    # In the order of the data flow, so that a loop that takes in order takes once a lap.
    roles = [*names[1:], names[0]] if arguments.role == "all" else [arguments.role]
    rclpy.init(args=[])
    try:
        nodes = [
            Recorder(arguments.laps, arguments.bag) if role == names[0] else RingNode(role, arguments.laps)
            for role in roles
        ]
        while not all(node.matched() for node in nodes):
            time.sleep(0.02)
        print("ready", flush=True)
        sys.stdin.readline()
        started = time.perf_counter()
        for node in nodes:
            if node.ros.get_name() == description.PLANT.name:
                node.publish()
        {"events": spin_events, "wait_set": spin_wait_set, "ordered": spin_ordered}[arguments.loop](nodes)
        print(time.perf_counter() - started, flush=True)
        for node in nodes:
            node.close()
        sys.stdin.readline()
    finally:
        rclpy.try_shutdown()
    return 0
