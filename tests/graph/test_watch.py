"""hsv watch beside a flight."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from node_processes import Processes, recorded_steps, short_scenario
from ros_domain import own_environment
from waiting import exit_code_of, wait_until

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

pytestmark = pytest.mark.graph


@pytest.mark.long
def test_a_flight_is_watched_to_its_end_and_its_bits_are_the_same(tmp_path: Path) -> None:
    scenario = short_scenario(tmp_path, duration=16, fault=1)
    bag = tmp_path / "bag"
    with own_environment() as environment:
        processes = Processes(environment, tmp_path)
        flying = processes.start(
            "hsv", "run", scenario, "--real-time-factor", "0.02", "--no-report", "--bag", bag, "--composed"
        )
        wait_until(lambda: recorded_steps(bag) > 0, [flying.pid])
        said = tmp_path / "watched"
        with said.open("w") as output:
            watching = processes.start("hsv", "watch", "--json", output=output)
        # The flight takes its time until somebody sees it, however long that one starts.
        wait_until(lambda: "{" in said.read_text(), [watching.pid])
        faster = processes.run("ros2", "run", "hsv_bringup", "set_parameter", "real_time_factor", "2")
        assert faster.returncode == 0, faster.stdout
        assert exit_code_of(watching) == 0 == exit_code_of(flying), said.read_text()
        processes.stop()
    rows = [json.loads(line) for line in said.read_text().splitlines() if line.startswith("{")]
    times = [row["time"] for row in rows]
    assert len(rows) > 2 and times == sorted(set(times)) and times[-1] <= 16.0
    last = rows[-1]
    assert last["faults"] == ["elevator_deflection loss_of_effectiveness"]
    assert 0.0 <= last["tube_level"] <= 1.0 and 26000.0 < last["altitude"] < 26400.0 and last["velocity_error"] < 0.0
    assert flight_fingerprint(Bag(bag)) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint


@pytest.mark.long
def test_where_nobody_flies_it_is_one_line(tmp_path: Path) -> None:
    with own_environment() as environment:
        processes = Processes(environment, tmp_path)
        done = processes.run("hsv", "watch")
        processes.stop()
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1].startswith("hsv watch: error: no run in ROS_DOMAIN_ID=")
