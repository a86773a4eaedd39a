"""The node that estimates the elevator's effectiveness flies what the compiled loop flies, and says what it found."""

from __future__ import annotations

from pathlib import Path

import pytest
from node_processes import Processes, short_scenario

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

pytestmark = pytest.mark.graph


def active_scenario(folder: Path) -> Path:
    """Return a shortened Case 1 with the estimator, which loses half of the elevator."""
    # Of ten seconds at least: hsv replay refuses a shorter flight.
    path = short_scenario(folder, duration=11)
    text = path.read_text(encoding="utf-8")
    assert text.count("effectiveness = 0.9") == 1
    lost = text.replace("effectiveness = 0.9", "effectiveness = 0.5")
    path.write_text(f"{lost}\n[effectiveness]\nenabled = true\n", encoding="utf-8")
    return path


@pytest.mark.long
def test_node_in_process_and_replay_are_the_same(processes: Processes, tmp_path: Path) -> None:
    scenario, bag_path = active_scenario(tmp_path), tmp_path / "bag"
    flown = processes.run("hsv", "run", scenario, "--bag", bag_path, "--no-report")
    assert flown.returncode == 0, flown.stdout
    bag = Bag(bag_path)
    assert flight_fingerprint(bag) == fly(assemble_flight(load_scenario(str(scenario)))).fingerprint
    replayed = processes.run("hsv", "replay", bag_path)
    assert replayed.returncode == 0, replayed.stdout
    said = [
        {pair.key: pair.value for pair in status.values}
        for _, message in bag.decode("diagnostics")
        for status in message.status
        if status.name.startswith("tube_mpc")
    ]
    assert said[0]["elevator"] == "HEALTHY" and said[-1]["elevator"] == "LOSS"
    assert float(said[-1]["effectiveness"]) == pytest.approx(0.5, abs=0.01)
    assert all(0.0 < float(values["step_time_p99_ms"]) < 1e3 for values in said)
