"""The node that estimates the elevator's effectiveness flies what the compiled loop flies, and says what it found."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from hsv.recording.reader import Bag
from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario

pytestmark = pytest.mark.graph

SHORT = """
extends = "case1_active_deep"
title = "short"
duration = "12 s"
[[fault]]
channel = "elevator_deflection"
type = "loss_of_effectiveness"
effectiveness = 0.5
start = "6 s"
"""


def test_node_in_process_and_replay_are_the_same(ros_environment: dict[str, str], tmp_path: Path) -> None:
    scenario, bag = tmp_path / "short.toml", tmp_path / "bag"
    scenario.write_text(SHORT, encoding="utf-8")
    environment = {**os.environ, **ros_environment}
    flight = fly(assemble_flight(load_scenario(str(scenario))))
    for command in (["run", str(scenario), "--bag", str(bag), "--no-report"], ["replay", str(bag)]):
        done = subprocess.run(["hsv", *command], env=environment, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1), done.stderr
        if command[0] == "run":
            assert flight.fingerprint in "".join(done.stdout.split()), done.stdout
        else:
            assert done.returncode == 0, done.stdout + done.stderr
    said = [
        {pair.key: pair.value for pair in status.values}
        for _, message in Bag(bag).decode("diagnostics")
        for status in message.status
        if status.name.startswith("tube_mpc")
    ]
    assert said[0]["elevator"] == "HEALTHY" and said[-1]["elevator"] == "LOSS"
    assert float(said[-1]["effectiveness"]) == pytest.approx(0.5, abs=0.01)
