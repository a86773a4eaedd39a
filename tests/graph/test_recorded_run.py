"""A run of real nodes: replayed by real nodes, played again, and read by other tools."""

from __future__ import annotations

import sys
import textwrap

import pytest
from bag_readers import READERS, assert_equal, ours
from node_processes import short_scenario
from waiting import exit_code_of, wait_until

from hsv.bags.description import TOPICS

pytestmark = pytest.mark.graph

STEPS = 601


@pytest.fixture(scope="module")
def bag(shared_processes):
    """Return the bag of a flight of 12 s, long enough for a replay."""
    scenario = short_scenario(shared_processes.folder, duration=12, fault=6)
    done = shared_processes.run("hsv", "run", scenario, "--bag", shared_processes.folder / "flown")
    assert done.returncode == 0, done.stdout
    return shared_processes.folder / "flown"


@pytest.mark.parametrize("words", ["", "--rerun", "--over-dds"])
def test_replay_is_identical_in_every_byte(shared_processes, bag, words):
    done = shared_processes.run("hsv", "replay", bag, *words.split())
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("identical in every byte") == 5, done.stdout


@pytest.mark.parametrize("read", READERS)
def test_others_read_it_alike(bag, read):
    assert assert_equal(ours(bag), read(bag)) > STEPS * len(TOPICS)


SUBSCRIBE = textwrap.dedent(
    """
    import sys
    import rclpy
    from rclpy.experimental import EventsExecutor
    from hsv.bags.description import LATCHED_TOPICS, OTHER_TOPICS, ROSOUT, RUN, TOPICS
    from hsv.bags.reader import Bag
    from hsv_node.middleware import LATCHED, STEP, message_class

    rclpy.init()
    node = rclpy.create_node("subscriber")
    recorded = Bag(sys.argv[1])
    topics = sys.argv[2].split(",")
    heard = {topic: [] for topic in topics}
    for topic in topics:
        node.create_subscription(message_class(TOPICS[topic.strip("/")]), topic, heard[topic].append, STEP, raw=True)
    executor = EventsExecutor()
    executor.add_node(node)
    expected = {topic: [data for _, data in recorded.messages(topic)] for topic in topics}

    def wait(done, what):
        print("waits for", what, flush=True)
        while not done():
            executor.spin_once(timeout_sec=0.05)

    wait(lambda: all(node.count_publishers(topic) for topic in topics), "a player")
    wait(lambda: all(len(messages) >= 3 for messages in heard.values()), "three steps")
    # A late subscriber of a latched topic gets what was played before, among the log of nodes that run now.
    for topic, kind in {"/hsv/run": LATCHED_TOPICS[RUN], ROSOUT: OTHER_TOPICS[ROSOUT]}.items():
        played, late = {data for time, data in recorded.messages(topic) if time <= 40_000_000}, []
        node.create_subscription(message_class(kind), topic, late.append, LATCHED, raw=True)
        assert played
        wait(lambda: played <= {*late}, "what was played on " + topic)
    wait(lambda: all(len(heard[topic]) >= len(expected[topic]) for topic in topics), "the end")
    assert heard == expected
    print("all", sum(map(len, heard.values())))
    """
)


def test_player_plays_the_recorded_bytes(shared_processes, bag):
    topics = ["/hsv/state", "/hsv/command"]
    log = shared_processes.folder / "subscriber.log"
    with log.open("w") as output:
        words = [sys.executable, "-c", SUBSCRIBE, bag, ",".join([*topics, "/clock"])]
        subscriber = shared_processes.start(*words, output=output)
        wait_until(lambda: "waits for a player" in log.read_text(), [subscriber.pid])
    words = ["--rate", "4", "--delay", "5", "--topics", *topics, "/hsv/run", "/rosout"]  # 5 s: see docs/replay.md
    played = shared_processes.run("ros2", "run", "hsv_bringup", "player", bag, *words)
    assert played.returncode == 0, played.stdout
    assert exit_code_of(subscriber) == 0, log.read_text()
    assert f"all {3 * STEPS}" in log.read_text()
