"""A recorder killed at a random moment loses what was on its way to the disk and nothing else.

HSV_KILLS=20 python3 -m pytest tests/graph/test_killed_recorder.py
"""

from __future__ import annotations

import os
import random
import signal
import sys
import textwrap
import time
from pathlib import Path

import pytest
from node_processes import Processes, children, short_scenario
from rosbags.rosbag2 import Reader
from waiting import output_of, wait_until

from hsv.bags.description import TOPICS
from hsv.bags.reader import Bag
from hsv_plant.plant import MAX_AHEAD

pytestmark = pytest.mark.graph

KILLS = int(os.environ.get("HSV_KILLS", "2"))
PERIOD = 0.02
SUBSCRIBE = textwrap.dedent(
    """
    import struct, time
    import rclpy
    from hsv_msgs.msg import VehicleState
    from hsv_node.middleware import STEP
    from rclpy.experimental import EventsExecutor

    rclpy.init()
    node = rclpy.create_node("subscriber")

    def heard(data):
        sec, nanosec = struct.unpack_from("<iI", data, 4)
        print(time.monotonic(), round((sec + 1e-9 * nanosec) / 0.02), flush=True)

    node.create_subscription(VehicleState, "/hsv/state", heard, STEP, raw=True)
    executor = EventsExecutor()
    executor.add_node(node)
    while True:
        executor.spin_once(timeout_sec=0.25)
    """
)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(KILLS))
def test_bag_opens_and_has_all_but_the_last_moment(processes: Processes, seed: int) -> None:
    chance = random.Random(seed)
    bag = processes.folder / "killed"
    words = processes.folder / "heard.txt"
    with words.open("w") as stream:
        subscriber = processes.start(sys.executable, "-c", SUBSCRIBE, output=stream)
        run = processes.start("hsv", "run", short_scenario(processes.folder, duration=600, fault=3), "--bag", bag)
        last_step = chance.randrange(50, 1500)

        def flies() -> bool:
            assert run.poll() is None, run.communicate()[0]
            return len(words.read_text().splitlines()) > last_step

        wait_until(flies, [run.pid], lambda: words.stat().st_size)
        killed = time.monotonic()
        os.kill(children(run.pid)["recorder"], signal.SIGKILL)
        output = output_of(run)
        subscriber.kill()
        subscriber.wait()
    assert run.returncode == 1 and "recorder was killed by SIGKILL" in output
    assert _steps(bag) and Bag(bag).complete
    flown = [line.split() for line in words.read_text().splitlines() if len(line.split()) == 2]
    last = max(int(step) for moment, step in flown if float(moment) <= killed)
    lost = last + 1 - _steps(bag)
    print(f"killed at step {last}, lost {lost} steps, {lost * PERIOD:.2f} s")
    # How many depends on the machine; more than the plant may be ahead of what is on the disk, on none.
    assert lost <= MAX_AHEAD
    with Reader(bag) as reader:
        assert reader.message_count == sum(topic.count for topic in Bag(bag).topics.values())


def _steps(bag: Path) -> int:
    recorded = Bag(bag)
    steps = min(len(recorded.messages(topic)) for topic in TOPICS)
    for topic in TOPICS:
        stamps = recorded.times(topic)[:steps]
        assert stamps.tolist() == [round(k * PERIOD * 1e9) for k in range(steps)], topic
    return steps
