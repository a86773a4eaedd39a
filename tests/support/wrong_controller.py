"""The examples' regulators with a failure: ``python3 wrong_controller.py killed|hung|wrong_step|nan STEP``."""

import math
import os
import signal
import sys
import time

import rclpy
from hsv_example_node.regulator import Regulator
from hsv_lqr import Lqr


class SlowLqr(Lqr):
    """A regulator that takes some seconds for its hundredth step."""

    SECONDS = 4.0

    def reset(self):
        self.steps = 0
        super().reset()

    def step(self, inputs):
        self.steps += 1
        time.sleep(self.SECONDS if self.steps == 100 else 0.0)
        return super().step(inputs)


def main(how, step):
    """Fly, and fail in the way ``how`` at a step."""
    rclpy.init()
    node = Regulator()
    publish = node.command.publish

    def go_wrong(message):
        if message.step == step and how == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        elif message.step == step and how == "hung":
            time.sleep(3600.0)
        elif message.step == step and how == "wrong_step":
            message.step -= 1
        elif message.step == step and how == "nan":
            message.elevator_deflection = math.nan
        publish(message)

    node.command.publish = go_wrong
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
