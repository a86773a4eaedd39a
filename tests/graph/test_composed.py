"""The graph in one process, by hand: the same services. That its bytes are the same, test_lockstep.py shows."""

from __future__ import annotations

import pytest
from injected_fault import LONG, inject_and_land
from node_processes import Processes

pytestmark = pytest.mark.graph


@pytest.mark.long
def test_composed_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    words = ["-p", f"bag.directory:={bag}", *LONG]
    inject_and_land(processes, processes.start("ros2", "run", "hsv_bringup", "composed", "--ros-args", *words), bag)
