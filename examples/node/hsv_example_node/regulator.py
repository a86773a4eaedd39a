"""A controller as a separate ROS 2 node, which uses nothing of the bench except its messages."""

from contextlib import suppress

import numpy as np
import rclpy
from hsv_msgs.msg import ControlInput, FilteredState, NominalState
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile

GAIN = np.array(  # of a linear-quadratic regulator about 85 500 ft and 7900 ft/s: fuel (-), elevator (rad)
    [[-5.05e-3, -2.26e-2, 69.9, -99.0, -8.85], [9.26e-4, -4.46e-3, -10.4, 24.8, 4.50]]
)
LIMITS = np.array([0.0, -np.pi / 6]), np.array([1.5, np.pi / 6])


class Regulator(Node):
    """Publishes the command of a step when both the filtered and the nominal state of the step have arrived."""

    def __init__(self):
        super().__init__("regulator")
        deep = QoSProfile(depth=256)
        self.command = self.create_publisher(ControlInput, "hsv/command", deep)
        self.filtered = self.nominal = None
        self.create_subscription(FilteredState, "hsv/filtered_state", self.on_filtered, deep)
        self.create_subscription(NominalState, "hsv/nominal", self.on_nominal, deep)

    def on_filtered(self, message):  # either message may come first
        self.filtered = message
        self.answer()

    def on_nominal(self, message):
        self.nominal = message
        self.answer()

    def answer(self):
        if self.filtered is None or self.nominal is None or self.filtered.step != self.nominal.step:
            return
        x, x_r, u_r = self.filtered.state, self.nominal.reference, self.nominal.reference_input
        names = ("altitude", "velocity", "angle_of_attack", "pitch_angle")
        error = [getattr(x, name) - getattr(x_r, name) for name in names]
        error.append(self.filtered.filtered_pitch_rate - x_r.pitch_rate)
        wanted = GAIN @ error + (u_r.fuel_equivalence_ratio, u_r.elevator_deflection)
        limited = np.clip(wanted, *LIMITS)
        fuel, elevator = limited.tolist()
        self.command.publish(
            ControlInput(
                header=self.filtered.header,
                step=self.filtered.step,
                fuel_equivalence_ratio=fuel,
                elevator_deflection=elevator,
                saturated=(limited != wanted).tolist(),
            )
        )


def main():
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Regulator())
