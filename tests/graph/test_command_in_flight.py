"""Points commanded in flight, from outside: refused, taken, stamped with their step, recorded, repeated."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import numpy as np
import pytest
from hsv_msgs.msg import Reference
from injected_fault import last_line
from node_processes import Processes, fly_until, short_scenario
from waiting import output_of

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps, flown_parameters
from hsv.bags.replay.engine import replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.control.reference_trajectory import COLUMNS

pytestmark = pytest.mark.graph

PERIOD = 0.02


@pytest.mark.long
def test_points_are_commanded_recorded_and_repeated(processes: Processes, tmp_path: Path) -> None:
    bag_path = tmp_path / "flown"
    scenario = short_scenario(tmp_path, duration=3600, fault=6)
    flight = processes.start("hsv", "run", scenario, "--bag", bag_path, "--real-time-factor", "2.0", "--no-report")
    fly_until(flight, bag_path, 50)
    # Paused, the second command certainly comes before the first is flown.
    assert processes.run("hsv", "set", "paused", "true").returncode == 0
    refused = processes.run("hsv", "command", "200000 ft", "8000 ft/s")
    assert refused.returncode == 2
    assert "altitude = 60960 m: expected" in last_line(refused)
    refused = processes.run("hsv", "command", "85302 ft", "7874 ft/s", "--blend", "0.02 s")
    assert refused.returncode == 2
    assert "no reference to 26000 m and 2400 m/s fits" in last_line(refused)
    taken = []
    for point in (("86000 ft", "8120 ft/s"), ("86100 ft", "8150 ft/s")):
        done = processes.run("hsv", "command", *point, "--blend", "1.5 s", "--json")
        assert done.returncode == 0, done.stdout
        taken.append(json.loads(last_line(done)))
    assert processes.run("hsv", "set", "real_time_factor", "0").returncode == 0
    assert processes.run("hsv", "set", "paused", "false").returncode == 0
    fly_until(flight, bag_path, taken[1]["step"] + 150)
    flight.send_signal(signal.SIGINT)
    output = output_of(flight)
    assert flight.returncode == 130, output

    bag = Bag(bag_path)
    published = [message for _, message in bag.decode("/hsv/reference")]
    first, second = (answer["step"] for answer in taken)
    flown, planning, rejected = Reference.FLOWN, Reference.PLANNING, Reference.REJECTED
    assert [message.status for message in published] == [flown, planning, rejected, *[planning, flown] * 2]
    assert [message.step for message in published] == [0, first, first, first, first, second, second]
    corners = [np.array([getattr(message, name) for name in COLUMNS]).T for message in published]
    planned, once, twice = (corners[row] for row in (0, 4, 6))
    for row, unchanged in ((1, planned), (2, planned), (3, planned), (5, once)):
        assert np.array_equal(corners[row], unchanged)
    assert np.array_equal(once[: len(planned)], planned) and np.array_equal(twice[: len(once)], once)
    assert np.array_equal(twice[-1, 1:], [26243.28, 2484.12, 1.5])
    assert [answer["end_s"] for answer in taken] == pytest.approx([once[-1, 0] + 1.5, twice[-1, 0] + 1.5])
    # The second begins to turn where the first has its last corner.
    assert second * PERIOD == pytest.approx(once[-1, 0] + PERIOD - 1.5)
    altitude = bag.columns("/hsv/nominal")["reference.altitude"]
    assert np.flatnonzero(np.diff(altitude))[0] == first

    values = flown_parameters(bag)
    assert values.of("nominal_trajectory")["reference.times"] == twice[:, 0].tolist()
    results = [replay(bag, processes_of("nominal_trajectory")["nominal_trajectory"], values, lambda *_: None)]
    values.shared["duration"] = complete_steps(bag) * PERIOD
    results += rerun(bag, "tube_mpc", values, lambda *_: None)
    assert all(result.identical for result in results)
    done = processes.run("hsv", "replay", bag_path, "--over-dds", "--node", "nominal_trajectory")
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("identical in every byte") == 1, done.stdout
