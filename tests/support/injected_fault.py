"""A fault of the fuel injected in flight and cleared again by service calls, and what the bag must then show."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from node_processes import Processes, recorded_steps
from waiting import exit_code_of, wait_until

from hsv.recording.reader import Bag
from hsv.replay.attached import complete_steps

INJECT = textwrap.dedent(
    """
    import rclpy
    from hsv_msgs.msg import Fault, VehicleState
    from hsv_msgs.srv import ClearFault, InjectFault

    rclpy.init()
    node = rclpy.create_node("tester")

    def call(kind, name, request):
        client = node.create_client(kind, name)
        while not client.wait_for_service(1.0):
            pass
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future)
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
    # So that it acts in a step at least.
    flown = steps[-1]
    while steps[-1] < flown + 5:
        rclpy.spin_once(node, timeout_sec=0.1)
    cleared = call(ClearFault, "/hsv/clear_fault", ClearFault.Request(channel="fuel_equivalence_ratio"))
    assert cleared.accepted, cleared
    print("acts", injected.step, "until", cleared.step)
    """
)
"""Script of a process of its own; waits for a flight to call into."""

LONG = ["-p", "duration:=600.0", "-p", "real_time_factor:=2.0"]
"""Parameters of a flight that does not end before the script, however slow the machine: it is interrupted."""


def inject_and_land(processes: Processes, flying: subprocess.Popen[str], bag: Path) -> None:
    """Inject and clear a fault in the flight of ``flying``, interrupt it later, check what was recorded."""
    script = processes.run(sys.executable, "-c", INJECT)
    assert script.returncode == 0, script.stdout
    _, first, _, end = script.stdout.split()[-4:]
    wait_until(lambda: recorded_steps(bag) > int(end), [flying.pid], lambda: recorded_steps(bag))
    flying.send_signal(signal.SIGINT)
    assert exit_code_of(flying) == 128 + signal.SIGINT
    processes.stop()
    _assert_fault_acted(Bag(bag), int(first), int(end))


def _assert_fault_acted(bag: Bag, first: int, end: int) -> None:
    steps = complete_steps(bag)
    assert bag.complete and first < end < steps
    active = [message.step for _, message in bag.decode("/hsv/fault_status") if message.active]
    assert active == list(range(first, end))
    actuator, command = (bag.columns(topic)["fuel_equivalence_ratio"] for topic in ("/hsv/actuator", "/hsv/command"))
    ratio = actuator[:steps] / command[:steps]
    assert ratio[active] == pytest.approx(0.95)
