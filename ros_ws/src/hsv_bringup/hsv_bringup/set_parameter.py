"""Sets a parameter of a running node: ``ros2 run hsv_bringup set_parameter tube_mpc feedback.tau "[0.8]"``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

import rclpy
import yaml
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import NameValidationException
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.utilities import remove_ros_args

from hsv.graph.progress import Standstill
from hsv_node.lockstep import SAY_AFTER

PATIENCE = 30.0
"""Seconds to wait for a node that is not there while nothing else changes on its ROS domain either."""


def set_parameter(node_name: str, name: str, value: object) -> SetParametersResult:
    """Return what the node says to a new ``value``; not successful as well where no such node comes.

    A node that is there may take its time to answer: its absence is an error, slowness is only told.
    """
    parameter = Parameter(name, value=value).to_parameter_msg()
    node = rclpy.create_node("set_parameter", enable_rosout=False)
    try:
        client = AsyncParameterClient(node, node_name)
        answer = None
        standstill, begun, said = Standstill(), time.monotonic(), 0
        while not (answer and answer.done()):
            if answer is None and client.services_are_ready():
                answer = client.set_parameters([parameter])
            rclpy.spin_once(node, timeout_sec=0.1)
            names = sorted(space.rstrip("/") + "/" + other for other, space in node.get_node_names_and_namespaces())
            is_there = "/" + node_name.lstrip("/") in names
            # While it is there, time itself is progress.
            if standstill.look(time.monotonic() if is_there else names) > PATIENCE:
                return SetParametersResult(successful=False, reason=f"no node {node_name!r} in {PATIENCE:g} s")
            if time.monotonic() - begun > (said + 1) * SAY_AFTER:
                said += 1
                print(f"waiting for {'an answer of ' if is_there else ''}{node_name}", file=sys.stderr, flush=True)
        return answer.result().results[0]
    except NameValidationException:
        expected = "expected the name of a node, such as tube_mpc"
        return SetParametersResult(successful=False, reason=f"node = {node_name!r}: {expected}")
    finally:
        node.destroy_node()


def main(args: Sequence[str] | None = None) -> int:
    """Set the parameter and print the answer; return 0 only if the node took it."""
    parser = argparse.ArgumentParser(prog="set_parameter", description=__doc__)
    parser.add_argument("node", help="name of the node, e.g. tube_mpc")
    parser.add_argument("parameter", help="e.g. feedback.tau")
    parser.add_argument("value", help='in YAML, e.g. "[0.8]"')
    given = list(sys.argv[1:] if args is None else args)
    asked = parser.parse_args(remove_ros_args(given))
    rclpy.init(args=given)
    try:
        result = set_parameter(asked.node, asked.parameter, yaml.safe_load(asked.value))
    except (OverflowError, TypeError, ValueError, yaml.YAMLError) as error:
        result = SetParametersResult(successful=False, reason=" ".join(str(error).split()))
    finally:
        rclpy.try_shutdown()
    said = f"{asked.parameter} = {asked.value}"
    if result.successful:
        print(f"{said} is set")
        return 0
    # ROS itself refuses a value of another type without naming the parameter.
    named = asked.parameter in result.reason
    print(result.reason if named else f"{said}: {result.reason}", file=sys.stderr)
    return 1
