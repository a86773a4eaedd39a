"""The vehicle drawn beside a running graph: markers where the state says, and a flight that knows nothing of it."""

import json

import numpy as np
import pytest
from frames import composed
from node_processes import short_scenario
from waiting import wait_until

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.model.airframe.pose import LEVEL, Sample
from hsv.model.airframe.solids import solids

pytestmark = pytest.mark.graph

SEGMENT = next(solid.name for solid in solids() if "body" in solid.name)


def messages(path):
    """Return what the command has printed, without what it says while it waits and a line that is not whole."""
    lines = path.read_text().splitlines(keepends=True)
    return [json.loads(line) for line in lines if line.startswith("{") and line.endswith("\n")]


@pytest.mark.long
def test_markers_follow_the_state_of_a_flight_that_is_not_changed(processes):
    scenario = short_scenario(processes.folder, duration=4, fault=1)
    node = processes.start("ros2", "run", "hsv_bringup", "airframe", "--ros-args", "-p", "rate:=5.0")
    received = processes.folder / "markers"
    with received.open("w") as output:
        reader = processes.start("hsv", "topic", "/hsv/airframe", "--json", output=output)
        # So short a flight waits for neither of the two, and its first second may pass before they know of it.
        wait_until(lambda: "waiting for a message" in received.read_text(), [node.pid, reader.pid])
        ran = processes.run("hsv", "run", scenario, "--bag", "flown", "--real-time-factor", "1", "--no-report")
        assert ran.returncode in (0, 1), ran.stdout  # it may settle late
        wait_until(lambda: len(messages(received)) > 5, [node.pid, reader.pid])
        processes.stop()

    bag = Bag(processes.folder / "flown")
    assert flight_fingerprint(bag) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint
    state = bag.columns("hsv/state")
    for message in messages(received):
        markers = json.loads(message["markers"])
        assert {marker["header"]["frame_id"] for marker in markers} == {LEVEL}
        assert [marker["ns"] for marker in markers] == [*(solid.name for solid in solids()), "label"]
        [row] = np.flatnonzero(state["header.stamp"] == markers[0]["header"]["stamp"])
        names = ("angle_of_attack", "pitch_angle", "elastic_coordinate_1", "elastic_coordinate_2")
        frames = composed(Sample(*(float(state[name][row]) for name in names), 0.0, 0.0))
        [nose] = [marker["pose"]["position"] for marker in markers if marker["ns"] == SEGMENT]
        assert [nose["x"], nose["z"]] == pytest.approx([frames[SEGMENT].x, frames[SEGMENT].z], abs=1e-12)
