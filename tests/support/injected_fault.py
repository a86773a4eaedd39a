"""A fault of the fuel injected in flight and cleared again by service calls, and what the bag must then show."""

from __future__ import annotations

import textwrap

import pytest

from hsv.recording.reader import Bag

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
"""Script of a process of its own; waits for a flight to call into."""


def assert_fault_acted(bag: Bag, output: str) -> None:
    """Check a flight of 301 steps against what :data:`INJECT` printed."""
    _, first, _, end = output.split()[-4:]
    assert bag.topics["/hsv/state"].count == 301
    active = [message.step for _, message in bag.decode("/hsv/fault_status") if message.active]
    assert active == list(range(int(first), int(end)))
    ratio = (
        bag.columns("/hsv/actuator")["fuel_equivalence_ratio"] / bag.columns("/hsv/command")["fuel_equivalence_ratio"]
    )
    assert ratio[active] == pytest.approx(0.95)
