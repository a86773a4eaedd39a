"""The player at its end, and words and bags it cannot use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from changed_bags import Messages, changed_bag
from flown_bags import flown_bag
from marking import long
from node_processes import Processes
from ros_domain import own_domain
from waiting import wait_until

from hsv.bags.reader import Bag
from hsv.bags.topic import Topic
from hsv.graph.exclusive import claim

pytestmark = pytest.mark.graph

STEPS = 3


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of three steps."""
    folder = tmp_path_factory.mktemp("bags")

    def begin(_: str, messages: Messages) -> Messages:
        return messages[:STEPS]

    return changed_bag(flown_bag(folder / "flown", duration=1.0, fault=0.5), folder / "short", messages=begin)


def test_a_step_at_the_end_is_refused(bag: Path) -> None:
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from std_srvs.srv import Trigger

    from hsv_bringup.player import PlayerNode

    with own_domain() as number:
        rclpy.init(domain_id=number)
        try:
            player = PlayerNode(Bag(bag), ["/hsv/state"], 1.0, paused=True, delay=0.0)
            asking = rclpy.create_node("asking")
            executor = SingleThreadedExecutor()
            for node in (player, asking):
                executor.add_node(node)
            client = asking.create_client(Trigger, "/player/step")
            wait_until(client.service_is_ready, pause=executor.spin_once)
            calls = [client.call_async(Trigger.Request()) for _ in range(STEPS + 1)]
            wait_until(lambda: all(call.done() for call in calls), pause=executor.spin_once)
            assert [call.result().success for call in calls] == [True] * STEPS + [False]
            assert calls[-1].result().message == "at the end, nothing is left to publish"
        finally:
            rclpy.shutdown()


@pytest.mark.parametrize("delay", [*map(long, ("nan", "inf", "-1"))])
def test_a_delay_that_never_ends_is_refused(processes: Processes, bag: Path, delay: str) -> None:
    done = processes.run("hsv", "play", bag, "--delay", delay, "--topic", "/hsv/state")
    assert done.returncode == 2
    (line,) = [line for line in done.stdout.splitlines() if "warning" not in line]
    assert line.startswith(f"player: error: delay = {float(delay)}: expected a finite number")


@pytest.mark.long
def test_a_message_type_that_is_not_installed_is_named(processes: Processes, bag: Path) -> None:
    def foreign(topic: Topic) -> Topic:
        if topic.name != "/hsv/forces":
            return topic
        return replace(topic, name="/other", type="other_msgs/msg/Other", definition="float64 data\n")

    made = changed_bag(bag, processes.folder / "made", foreign)
    done = processes.run("hsv", "play", made)
    assert done.returncode == 2
    assert "topic /other: message type other_msgs/msg/Other is not installed" in done.stdout.splitlines()[-1]


@pytest.mark.long
def test_topics_of_a_graph_that_is_there_are_not_played(processes: Processes, bag: Path) -> None:
    domain = int(processes.environment["ROS_DOMAIN_ID"])
    held = claim("topic", domain, "/hsv/state")
    assert held is not None
    with held:
        done = processes.run("hsv", "play", bag)
        assert done.returncode == 2
        refused = f"player: error: another node publishes /hsv/state in ROS domain {domain}"
        assert done.stdout.splitlines()[-1].startswith(refused)
    assert processes.run("hsv", "play", bag, "--rate", "100").returncode == 0


@pytest.mark.long
def test_a_plant_that_waits_does_not_fly_on_what_is_played(processes: Processes, bag: Path) -> None:
    log = processes.folder / "plant.log"
    with log.open("w") as output:
        plant = processes.start("ros2", "run", "hsv_plant", "plant", output=output)
        wait_until(lambda: "waiting for" in log.read_text(), [plant.pid])
        words = ["--topic", "/hsv/actuator", "--no-clock", "--delay", "2"]

        def ignored() -> bool:
            # Played before the plant has found the player, nothing arrives: on a busy machine that takes its time.
            done = processes.run("hsv", "play", bag, *words)
            assert done.returncode == 0, done.stdout
            return "ignored" in log.read_text()

        wait_until(ignored, [plant.pid])
    assert "starts run" not in log.read_text()
