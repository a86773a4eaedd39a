"""The graph in one process: the same bytes as separate processes, the same services."""

from __future__ import annotations

import pytest
from injected_fault import LONG, inject_and_land
from node_processes import Processes, short_scenario

from hsv.graph.description import TOPICS

pytestmark = pytest.mark.graph


def test_composed_equals_separate_processes_in_every_byte(processes: Processes) -> None:
    scenario = short_scenario(processes.folder)
    for name, words in (("separate", []), ("composed", ["--composed"])):
        done = processes.run("hsv", "run", scenario, "--no-report", "--bag", processes.folder / name, *words)
        assert done.returncode == 0, done.stdout
    # Padding aside: what DDS leaves in it is whatever its buffer held before.
    compared = processes.run("hsv", "diff", processes.folder / "separate", processes.folder / "composed")
    assert compared.returncode == 0, compared.stdout
    assert f"{251 * len(TOPICS)} messages: identical in every byte" in compared.stdout


def test_composed_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    words = ["-p", f"bag.directory:={bag}", *LONG]
    inject_and_land(processes, processes.start("ros2", "run", "hsv_bringup", "composed", "--ros-args", *words), bag)
