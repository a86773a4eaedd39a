"""A vehicle in a file beside its scenario flies over DDS; the bag is enough to replay it."""

from __future__ import annotations

import json

import pytest
from node_processes import Processes

pytestmark = pytest.mark.graph

VEHICLE = """extends = "parker"
[rigid_body]
mass = { value = "4600 kg" }
"""

FLIGHT = """extends = "case1"
title = "a vehicle of one's own"
vehicle = "mine.toml"
duration = "12 s"
fault = []
[limits]
"""


@pytest.mark.long
def test_the_bag_takes_the_vehicle_along(processes: Processes) -> None:
    folder = processes.folder
    (folder / "lab").mkdir()
    (folder / "lab" / "mine.toml").write_text(VEHICLE)
    (folder / "lab" / "flight.toml").write_text(FLIGHT)
    bag = folder / "bag"
    ran = processes.run("hsv", "run", "lab/flight.toml", "--composed", "--bag", bag, "--json")
    assert ran.returncode == 0, ran.stdout
    alone = processes.run("hsv", "simulate", "lab/flight.toml", "--json")
    for path in (folder / "lab").iterdir():
        path.unlink()
    replayed = processes.run("hsv", "replay", bag)
    assert replayed.returncode == 0, replayed.stdout
    assert replayed.stdout.count("identical in every byte") == 5
    info = json.loads(processes.run("hsv", "info", bag, "--json").stdout)
    assert info["fingerprint"] == json.loads(alone.stdout)["fingerprint"]
    rerun = processes.run("hsv", "replay", bag, "--rerun")
    assert rerun.returncode == 0, rerun.stdout
