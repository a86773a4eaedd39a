"""Undocumented names of rclpy that the nodes use, each in one test: a port to another distribution begins here."""

import pytest
import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import serialize_message
from std_msgs.msg import String

pytestmark = pytest.mark.graph


@pytest.fixture
def node():
    """Yield a node that was given a parameter and does not declare it."""
    context = rclpy.Context()
    rclpy.init(context=context)
    made = rclpy.create_node("probe", context=context, cli_args=["--ros-args", "-p", "given:=[1.0]"])
    yield made
    made.destroy_node()
    rclpy.shutdown(context=context)


def test_parameter_overrides_of_a_node_list_what_it_was_given(node):
    assert {name: list(given.value) for name, given in node._parameter_overrides.items()} == {"given": [1.0]}


def test_the_handle_of_a_publisher_publishes_bytes(node):
    publisher = node.create_publisher(String, "probe", 1)
    publisher.handle.publish_raw(serialize_message(String(data="probe")))


def test_the_implementation_has_the_errors_of_the_middleware_and_of_ros_arguments():
    assert issubclass(rclpy_implementation.RCLError, Exception)
    assert issubclass(rclpy_implementation.UnknownROSArgsError, Exception)
