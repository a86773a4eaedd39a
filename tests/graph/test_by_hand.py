"""The nodes started one by one with ``ros2 run``, faults injected in flight, bad parameters refused."""

from __future__ import annotations

import sys
import textwrap

import pytest
from node_processes import Processes

from hsv.graph.description import graph
from hsv.recording.reader import Bag

pytestmark = pytest.mark.graph

INJECT = textwrap.dedent(
    """
    import rclpy
    from hsv_msgs.msg import Fault, VehicleState
    from hsv_msgs.srv import ClearFault, InjectFault

    rclpy.init()
    node = rclpy.create_node("tester")

    def call(kind, name, request):
        client = node.create_client(kind, name)
        assert client.wait_for_service(20.0)
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future, timeout_sec=20.0)
        return future.result()

    def inject(channel, kind, value):
        fault = Fault(channel=channel, type=kind, value=value)
        return call(InjectFault, "/hsv/inject_fault", InjectFault.Request(fault=fault))

    while not node.count_publishers("/hsv/state"):
        rclpy.spin_once(node, timeout_sec=0.1)
    steps = []
    node.create_subscription(VehicleState, "/hsv/state", lambda message: steps.append(message.step), 10)
    while not steps:
        rclpy.spin_once(node, timeout_sec=0.1)
    refused = inject("rudder", "loss_of_effectiveness", 0.5)
    assert not refused.accepted and "rudder" in refused.message, refused
    refused = inject("elevator_deflection", "loss_of_effectiveness", 1.5)
    assert not refused.accepted and "1.5" in refused.message, refused
    injected = inject("fuel_equivalence_ratio", "loss_of_effectiveness", 0.95)
    assert injected.accepted, injected
    cleared = call(ClearFault, "/hsv/clear_fault", ClearFault.Request(channel="fuel_equivalence_ratio"))
    assert cleared.accepted, cleared
    print("acts", injected.step, "until", cleared.step)
    """
)


def test_nodes_by_hand_with_a_fault_injected_in_flight(processes: Processes) -> None:
    bag = processes.folder / "by_hand"
    flight = ["-p", "duration:=6.0", "-p", "real_time_factor:=2.0"]
    extra = {"recorder": ["-p", f"bag.directory:={bag}"], "plant": flight}
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
    script = processes.run(sys.executable, "-c", INJECT)
    assert script.returncode == 0, script.stdout
    _, first, _, end = script.stdout.split()[-4:]
    assert nodes["plant"].wait(60.0) == 0
    processes.stop()
    assert [popen.returncode for popen in nodes.values()] == [0] * len(nodes)
    recorded = Bag(bag)
    assert recorded.topics["/hsv/state"].count == 301
    active = [message.step for _, message in recorded.decode("/hsv/fault_status") if message.active]
    assert active == list(range(int(first), int(end)))
    ratio = (
        recorded.columns("/hsv/actuator")["fuel_equivalence_ratio"]
        / recorded.columns("/hsv/command")["fuel_equivalence_ratio"]
    )
    assert ratio[active] == pytest.approx(0.95)


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
            ["design 'baseline': claim fails: tube.centre[0]"],
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
    done = processes.run("ros2", "run", package, executable, "--ros-args", *arguments, timeout=30.0)
    assert done.returncode == 2, done.stdout
    lines = [line for line in done.stdout.splitlines() if line.startswith(f"{executable}: error: ")]
    assert len(lines) == 1, done.stdout
    for word in words:
        assert word in lines[0]
    assert not list(processes.folder.iterdir())
