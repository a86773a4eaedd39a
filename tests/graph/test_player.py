"""The player next to a graph that flies or waits."""

import pytest
from changed_bags import changed_bag
from recorded_flight import record_flight
from waiting import wait_until

from hsv.graph.exclusive import claim

pytestmark = pytest.mark.graph

STEPS = 3


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Return a bag of three steps."""
    folder = tmp_path_factory.mktemp("bags")
    flown = record_flight(folder / "flown", duration=1.0, fault=0.5).folder
    return changed_bag(flown, folder / "short", messages=lambda _, messages: messages[:STEPS])


@pytest.mark.long
def test_topics_of_a_graph_that_is_there_are_not_played(processes, bag):
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
def test_a_plant_that_waits_does_not_fly_on_what_is_played(processes, bag):
    log = processes.folder / "plant.log"
    with log.open("w") as output:
        plant = processes.start("ros2", "run", "hsv_plant", "plant", output=output)
        wait_until(lambda: "waiting for" in log.read_text(), [plant.pid])
        words = ["--topic", "/hsv/actuator", "--no-clock", "--delay", "2"]

        def ignored():
            # Messages played before the plant has discovered the player do not arrive; discovery may take some time.
            done = processes.run("hsv", "play", bag, *words)
            assert done.returncode == 0, done.stdout
            return "ignored" in log.read_text()

        wait_until(ignored, [plant.pid])
    assert "starts run" not in log.read_text()
