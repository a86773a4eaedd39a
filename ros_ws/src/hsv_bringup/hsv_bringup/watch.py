"""Show the current state of a running flight on one line: ``ros2 run hsv_bringup watch``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from hsv.bags.description import ACTUATOR, NOMINAL, STATE, TOPICS, TUBE_STATUS
from hsv.base.errors import RunError
from hsv.base.units import unit_system
from hsv.graph.snapshot import Snapshot
from hsv_bringup.client import GraphClient, OneLineParser, answer, run_client
from hsv_node.middleware import message_class

EVERY = 0.2
"""Wall time (s) between two updates."""

LATEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Quality of service of a viewer: publishers do not wait for it, and it may miss messages."""

_CLEARED = "\r\x1b[K"
"""Control sequence that returns to the start of the line and clears it."""


def _watch(client: GraphClient, options: argparse.Namespace) -> None:
    system = unit_system(options.units)
    latest: dict[str, Any] = {}
    for topic in (STATE, NOMINAL, TUBE_STATUS, ACTUATOR):

        def keep(message: Any, topic: str = topic) -> None:
            latest[topic] = message

        client.create_subscription(message_class(TOPICS[topic]), topic, keep, LATEST)
    state = client.resolve_topic_name(STATE)
    if not client.wait_for(lambda: {STATE, NOMINAL, ACTUATOR} <= latest.keys(), f"a step on {state}", (STATE,)):
        raise RunError(f"no run in {client.where}: expected hsv run, or nodes started by hand there")
    moves = sys.stdout.isatty() and not options.json
    shown = 0.0
    while client.wait_for(
        lambda: STATE in latest or not client.count_publishers(state), f"a step on {state}", for_ever=True
    ):
        if STATE not in latest:
            break
        reached = latest.pop(STATE)
        if time.monotonic() - shown < EVERY and reached.status == reached.RUNNING:
            continue
        shown = time.monotonic()
        snapshot = Snapshot.of(reached, latest[NOMINAL], latest.get(TUBE_STATUS), latest[ACTUATOR])
        if moves:
            print(_CLEARED + snapshot.in_words(system), end="", flush=True)
        else:
            answer(snapshot.in_words(system), asdict(snapshot), options.json)
    if moves:
        print()


def main(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = OneLineParser(prog="watch", description="Show on one line where the flight of a running graph is.")
    parser.add_argument("--units", default="metric", help="metric, si or paper")
    parser.add_argument("--json", action="store_true", help="print a JSON object (SI) on a line for each look")
    return run_client(parser, _watch, args)
