"""The graph on two hosts: vehicle and recorder on one, the controllers on the other, a network between them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from hosts import emulated_hosts
from node_processes import Processes
from waiting import output_of

pytestmark = pytest.mark.graph

PROFILE = Path(__file__).parents[2] / "ros_ws/src/hsv_bringup/config/lossy_network.xml"
VEHICLE_HOST = ("recorder", "fault_injector", "plant")
STEPS = 10_000
"""Of Case 1, after the first state."""


@pytest.mark.long
@pytest.mark.parametrize(("delay", "loss"), [(0.001, 0.0), (0.005, 0.01)])
def test_case1_across_two_hosts_has_the_published_fingerprint(
    processes: Processes, tmp_path: Path, delay: float, loss: float
) -> None:
    prepared = processes.run("hsv", "prepare", "case1", "--json", "--bag", "flown", "--folder", "flight")
    assert prepared.returncode == 0, prepared.stdout
    flight = json.loads(prepared.stdout)
    processes.environment |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE)}
    files = [word for path in flight["parameter_files"] for word in ("--params-file", path)]
    with emulated_hosts("vehicle", "control", delay=delay, loss=loss) as hosts:
        started = {}
        for node in flight["nodes"]:
            host = "vehicle" if node["name"] in VEHICLE_HOST else "control"
            words = hosts.command(host, "ros2", "run", node["package"], node["executable"], "--ros-args", *files)
            started[node["name"]] = processes.start(*words)
        said = output_of(started["plant"])
        assert started["plant"].returncode == 0, said
        processes.stop()
    concluded = processes.run("hsv", "conclude", "flown", "--no-report", "--json")
    assert concluded.returncode == 0, concluded.stdout
    assert json.loads(concluded.stdout)["as_published"] is True
    begun, ended = (
        float(stamp)
        for stamp in re.search(
            r"\[([\d.]+)\] \[plant\]: starts run.*\[([\d.]+)\] \[plant\]: run \w+ finished", said, re.S
        ).groups()
    )
    lap = (ended - begun) / STEPS
    print(f"delay {1e3 * delay:g} ms, loss {loss:.0%}: {1e3 * lap:.2f} ms a step, {lap / (2 * delay):.2f} of the least")
    # A step needs the network twice: measurement there, command back.
    assert lap > 2 * delay
