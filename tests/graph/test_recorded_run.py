"""A run of real nodes, repeated by real nodes, played again, and read by others."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from bag_readers import READERS, Messages, assert_equal, ours
from marking import long
from node_processes import Processes, short_scenario
from waiting import exit_code_of

from hsv.bags.description import TOPICS
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import flown_parameters
from hsv.bags.replay.engine import replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.control.design import find_design, read_parameters

pytestmark = pytest.mark.graph

STEPS = 601


@pytest.fixture(scope="module")
def bag(shared_processes: Processes) -> Path:
    """A flight of twelve seconds, long enough to be worth a replay."""
    scenario = short_scenario(shared_processes.folder, duration=12, fault=6)
    done = shared_processes.run("hsv", "run", scenario, "--bag", shared_processes.folder / "flown")
    assert done.returncode == 0, done.stdout
    return shared_processes.folder / "flown"


def test_replay_in_process_is_identical_in_every_byte(bag: Path) -> None:
    opened = Bag(bag)
    values = flown_parameters(opened)
    results = [replay(opened, process, values, lambda *_: None) for process in processes_of("tube_mpc").values()]
    results += rerun(opened, "tube_mpc", values, lambda *_: None)
    assert len(results) == 10 and all(result.identical for result in results)


@pytest.mark.parametrize("words", [long(["--node", "plant"]), long(["--node", "tube_mpc"]), ["--rerun"]], ids=" ".join)
def test_replay_over_dds_is_identical_in_every_byte(shared_processes: Processes, bag: Path, words: list[str]) -> None:
    done = shared_processes.run("hsv", "replay", bag, "--over-dds", *words)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("identical in every byte") == (5 if "--rerun" in words else 1), done.stdout


@pytest.mark.long
def test_a_node_that_does_not_start_is_named(shared_processes: Processes, bag: Path) -> None:
    wrong = shared_processes.folder / "wrong.yaml"
    values = read_parameters(find_design("baseline")) | {"design.certificate": "absent.json"}
    wrong.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    words = ["--over-dds", "--node", "tube_mpc", "--parameters", str(wrong)]
    done = shared_processes.run("hsv", "replay", bag, *words)
    assert done.returncode == 1
    assert "tube_mpc ended with exit code 2" in done.stdout and "absent.json" in done.stdout


@pytest.mark.parametrize("read", READERS)
def test_others_read_it_alike(bag: Path, read: Callable[[Path], Messages]) -> None:
    assert assert_equal(ours(bag), read(bag)) > STEPS * len(TOPICS)


HASHES = textwrap.dedent(
    """
    import json, sys
    import rclpy
    from hsv.bags.reader import Bag
    from hsv_node.middleware import message_class

    rclpy.init()
    node, other = rclpy.create_node("talker"), rclpy.create_node("asker")
    found = {}
    for name, topic in Bag(sys.argv[1]).topics.items():
        node.create_publisher(message_class(topic.type), name + "_hash", 1)
        while not (infos := other.get_publishers_info_by_topic(name + "_hash")):
            rclpy.spin_once(other, timeout_sec=0.05)
        version, value = infos[0].topic_type_hash.version, infos[0].topic_type_hash.value
        found[name] = f"RIHS{version:02x}_{bytes(value).hex()}"
    print(json.dumps(found))
    """
)


def test_type_hashes_are_those_of_the_running_ros(shared_processes: Processes, bag: Path) -> None:
    import json

    done = shared_processes.run(sys.executable, "-c", HASHES, bag)
    assert done.returncode == 0, done.stdout
    running = json.loads(done.stdout.splitlines()[-1])
    assert running == {name: topic.type_hash for name, topic in Bag(bag).topics.items()}


SUBSCRIBE = textwrap.dedent(
    """
    import sys
    import rclpy
    from rclpy.experimental import EventsExecutor
    from hsv.bags.description import LATCHED_TOPICS, OTHER_TOPICS, ROSOUT, RUN, TOPICS
    from hsv.bags.reader import Bag
    from hsv_node.middleware import LATCHED, STEP, message_class
    from std_srvs.srv import Trigger

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
        print("waits for", what)
        while not done():
            executor.spin_once(timeout_sec=0.05)

    def call(name):
        client = node.create_client(Trigger, "/player/" + name)
        wait(client.service_is_ready, name)
        future = client.call_async(Trigger.Request())
        wait(future.done, name)
        assert future.result().success, future.result().message
        return future.result().message

    wait(lambda: all(node.count_publishers(topic) for topic in topics), "no player")
    # Endpoints are announced in the order they were made: who answers knows the subscriptions above.
    call("pause")
    for step in range(1, 4):
        print(call("step"))
        wait(lambda: all(len(messages) >= step for messages in heard.values()), f"step {step}")
    assert all(len(messages) == 3 for messages in heard.values()), {t: len(m) for t, m in heard.items()}
    # A late subscriber of a latched topic gets what was played before, among the log of nodes that run now.
    for topic, kind in {"/hsv/run": LATCHED_TOPICS[RUN], ROSOUT: OTHER_TOPICS[ROSOUT]}.items():
        played, late = {data for time, data in recorded.messages(topic) if time <= 40_000_000}, []
        node.create_subscription(message_class(kind), topic, late.append, LATCHED, raw=True)
        assert played
        wait(lambda: played <= {*late}, "what was played on " + topic)
    print(call("resume"))
    wait(lambda: all(len(heard[topic]) >= len(expected[topic]) for topic in topics), "the end")
    assert heard == expected
    print("all", sum(map(len, heard.values())))
    """
)


def test_player_steps_and_plays_the_recorded_bytes(shared_processes: Processes, bag: Path) -> None:
    topics = ["/hsv/state", "/hsv/command"]
    words = ["--rate", "20", "--paused", "--topics", *topics, "/hsv/run", "/rosout"]
    player = shared_processes.start("ros2", "run", "hsv_bringup", "player", bag, *words)
    done = shared_processes.run(sys.executable, "-c", SUBSCRIBE, bag, ",".join([*topics, "/clock"]))
    assert done.returncode == 0, done.stdout
    assert "paused, played up to t = 0.040 s" in done.stdout and f"all {3 * STEPS}" in done.stdout
    assert exit_code_of(player) == 0


@pytest.mark.long
def test_player_keeps_the_pace(shared_processes: Processes, bag: Path) -> None:
    import time

    begun = time.monotonic()
    done = shared_processes.run("hsv", "play", bag, "--rate", "4", "--delay", "0", "--topic", "/hsv/state")
    assert done.returncode == 0, done.stdout
    assert time.monotonic() - begun >= 3.0


@pytest.mark.long
def test_bad_words_of_the_player_are_one_line(shared_processes: Processes, bag: Path) -> None:
    for words, said in (
        ([shared_processes.folder / "nowhere"], "does not exist"),
        ([bag, "--rate", "-1"], "rate = -1.0"),
        ([bag, "--topics", "/hsv/nowhere"], "no topic /hsv/nowhere"),
    ):
        done: subprocess.CompletedProcess[str] = shared_processes.run("ros2", "run", "hsv_bringup", "player", *words)
        assert done.returncode == 2 and said in done.stdout
        assert len([line for line in done.stdout.splitlines() if line]) == 1, done.stdout
