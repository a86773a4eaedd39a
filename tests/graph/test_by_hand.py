"""The nodes started one by one with ``ros2 run``, faults injected in flight, bad parameters refused."""

from __future__ import annotations

import pytest
from injected_fault import LONG, inject_and_land
from node_processes import Processes

from hsv.graph.description import graph

pytestmark = pytest.mark.graph


def test_nodes_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    extra = {"recorder": ["-p", f"bag.directory:={bag}"], "plant": LONG}
    nodes = {
        node.name: processes.start(
            "ros2",
            "run",
            node.package,
            node.executable,
            *(["--ros-args", *extra[node.name]] if node.name in extra else []),
        )
        for node in graph()
    }
    inject_and_land(processes, nodes["plant"], bag)
    assert [popen.returncode for name, popen in nodes.items() if name != "plant"] == [0] * (len(nodes) - 1)


@pytest.mark.parametrize(
    ("package", "executable", "arguments", "words"),
    [
        ("hsv_plant", "plant", ["-p", "duration:=10"], ["duration = 10", "expected double"]),
        (
            "hsv_plant",
            "plant",
            ["-p", "initial.altitude:=30000.0"],
            ["initial.altitude = 30000.0", "25908 to 26365.2 m"],
        ),
        (
            "hsv_plant",
            "plant",
            ["-p", "vehicle.coupling:=strong"],
            ["vehicle.coupling = 'strong'", "paper_like, derived"],
        ),
        (
            "hsv_plant",
            "fault_injector",
            ["-p", "fault.values:=[0.5, 0.5]", "-p", "fault.channels:=[elevator_deflection]"],
            ["fault."],
        ),
        ("hsv_ctrl", "tube_mpc", ["-p", "feedback.gain:=[1.0, 2.0]"], ["feedback.gain", "2 values, expected 18"]),
        ("hsv_ctrl", "tube_mpc", ["-p", "input.minimum:=[.nan, 0.0]"], ["input.minimum[0] = nan"]),
        (
            "hsv_ctrl",
            "tube_mpc",
            ["-p", "tube.centre:=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"],
            ["design 'baseline': claim fails: tube.centre["],
        ),
        ("hsv_ctrl", "notch_filter", ["-p", "notch.zero_frequency:=[15.0, 20.0]"], ["notch.zero_damping", "1 values"]),
        ("hsv_ctrl", "nominal_trajectory", ["-p", "reference.velocities:=[1.0]"], ["reference.velocities[0] = 1.0"]),
        ("hsv_ctrl", "nominal_trajectory", ["--params-file", "missing.yaml"], ["missing.yaml"]),
        ("hsv_bringup", "recorder", ["-p", "bag.attachments:=[nowhere.txt]"], ["bag.attachments = 'nowhere.txt'"]),
    ],
)
def test_bad_parameters_are_refused_in_one_line(
    processes: Processes, package: str, executable: str, arguments: list[str], words: list[str]
) -> None:
    done = processes.run("ros2", "run", package, executable, "--ros-args", *arguments)
    assert done.returncode == 2, done.stdout
    lines = [line for line in done.stdout.splitlines() if line.startswith(f"{executable}: error: ")]
    assert len(lines) == 1, done.stdout
    for word in words:
        assert word in lines[0]
    assert not list(processes.folder.iterdir())
