"""Settings of Fast DDS: ours by default, unless the user has set others."""

from __future__ import annotations

import subprocess
import sys

import pytest

from hsv_node.middleware import prefer_profiles

JOIN = """
from hsv_node.middleware import prefer_profiles
prefer_profiles()
import rclpy
from hsv_msgs.msg import Ready
rclpy.init()
node = rclpy.create_node("joins")
node.create_publisher(Ready, "hsv/ready", 1)
node.destroy_node()
rclpy.shutdown()
"""
"""A script with the first steps of every node."""


def said_by_fast_dds(environment, folder):
    """Return the output of a process that creates a node and a publisher."""
    words = [sys.executable, "-c", JOIN]
    done = subprocess.run(words, env=environment, cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("name", ["FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"])
def test_settings_named_in_the_environment_hold_alone(tmp_path, name):
    environment = {name: "mine.xml"}
    prefer_profiles(environment, tmp_path)
    assert environment == {name: "mine.xml"}


@pytest.mark.graph
def test_fast_dds_takes_our_settings_without_a_word(ros_environment, tmp_path):
    for name in ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"):
        ros_environment.pop(name, None)
    assert said_by_fast_dds(ros_environment, tmp_path) == ""
