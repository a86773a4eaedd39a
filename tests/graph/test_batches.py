"""A node that takes its messages in batches waits for single ones only after a while without any."""

import json
import subprocess
import sys

import pytest

SCRIPT = """
import json, time
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Int64
from hsv_bringup.flow_executor import BATCH, LOOKS, BatchExecutor

waits = 0
spin_once = SingleThreadedExecutor.spin_once

def counted(executor, timeout_sec=None):
    global waits
    waits += timeout_sec != 0.0
    spin_once(executor, timeout_sec)

SingleThreadedExecutor.spin_once = counted
rclpy.init()
node, received = rclpy.create_node("batches"), []
publisher = node.create_publisher(Int64, "numbers", 10)
node.create_subscription(Int64, "numbers", lambda message: received.append(message.data), 10)
executor = BatchExecutor()
executor.add_node(node)
executor.spin_once(0.01)
seen = [waits]
for number in range(50):
    publisher.publish(Int64(data=number))
    until = time.monotonic() + 4 * BATCH
    while time.monotonic() < until:
        executor.spin_once(0.25)
while len(received) < 50:
    executor.spin_once(0.25)
seen.append(waits)
for _ in range(LOOKS + 3):
    executor.spin_once(0.01)
seen.append(waits)
publisher.publish(Int64(data=50))
while len(received) < 51:
    executor.spin_once(0.25)
print(json.dumps({"received": received, "waits": seen}))
rclpy.shutdown()
"""


@pytest.mark.graph
def test_messages_of_a_steady_flow_are_not_waited_for(ros_environment):
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=ros_environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["received"] == list(range(51))
    at_first, flowing, silent = said["waits"]
    assert at_first == 1  # before any message
    # One for a message that a busy machine brings late, and one after it, of some 250 batches.
    assert flowing - at_first <= 10
    assert silent - flowing >= 2
