"""A node that sends wrong messages in flight: ``python3 wrong_message.py HOW STEP``, HOW a key of :data:`WRONG`."""

import sys

import rclpy
from hsv_msgs.msg import Actuator, ControlInput, Fault, FilteredState, Measurement, NominalState
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

LOSS = {"channel": "elevator_deflection", "type": "loss_of_effectiveness"}
WRONG = {
    "fault": ("hsv/actuator", Actuator(active=[Fault(channel="elevator_deflection", type="stuk")], since=[1])),
    "value": ("hsv/actuator", Actuator(active=[Fault(**LOSS, parameter_names=["effectiveness"])], since=[1])),
    "estimate": ("hsv/filtered_state", FilteredState(estimate=[1.0])),
    "states": ("hsv/filtered_state", FilteredState(filter_state=[0.0] * 4)),
    "gain": ("hsv/nominal", NominalState(gain=[1.0] * 9)),
    "command": ("hsv/command", ControlInput()),
    "measurement": ("hsv/measurement", Measurement()),
}
"""Topic and wrong message; the last two messages lack their end."""


def main(how, step):
    """Send the wrong message in every step from ``step`` on, as soon as the step begins."""
    rclpy.init()
    node = rclpy.create_node("disturber")
    deep = QoSProfile(depth=256)
    topic, message = WRONG[how]
    publishers = []

    def disturb(measured):
        if not publishers:  # not earlier: two publishers of the command are refused before the flight
            publishers.append(node.create_publisher(type(message), topic, deep))
        if measured.step >= step:
            # Only the step is set. The time stays different from that of the flight's own message.
            message.step = measured.step
            publishers[0].publish(serialize_message(message)[:-8] if topic.endswith(how) else message)

    node.create_subscription(Measurement, "hsv/measurement", disturb, deep)
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
