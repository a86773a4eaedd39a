"""Sets a parameter of a running node: ``ros2 run hsv_bringup set_parameter tube_mpc feedback.tau "[0.8]"``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import rclpy
import yaml
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.utilities import remove_ros_args

from hsv.graph.description import COMPOSED
from hsv.graph.progress import Standstill, processor_time_of

WAIT_TIMEOUT = 30.0
"""Seconds to wait for a node that is not there while no process of its name does anything, nor other nodes come."""

_LOOK = 1.0
"""Seconds between two looks at what moves."""


def set_parameter(node_name: str, name: str, value: object) -> SetParametersResult:
    """Return what the node says to a new ``value``; not successful as well where no such node comes.

    A node that is there, or on its way, may take its time: its absence is an error, slowness is only told.
    """
    parameter = Parameter(name, value=value).to_parameter_msg()
    node = rclpy.create_node("set_parameter", enable_rosout=False)
    try:
        client = AsyncParameterClient(node, node_name)
        answer = None
        standstill, begun, looks = Standstill(), time.monotonic(), 0
        while not (answer and answer.done()):
            if answer is None and client.services_are_ready():
                answer = client.set_parameters([parameter])
            rclpy.spin_once(node, timeout_sec=0.1)
            if time.monotonic() - begun < looks * _LOOK:
                continue
            looks += 1
            if standstill.look(_moves(node, node_name)) > WAIT_TIMEOUT:
                return SetParametersResult(successful=False, reason=f"no node {node_name!r} in {WAIT_TIMEOUT:g} s")
            if looks % 5 == 0:
                print(f"waiting for {node_name}", file=sys.stderr, flush=True)
        return answer.result().results[0]
    except NameValidationException:
        expected = "expected the name of a node, such as tube_mpc"
        return SetParametersResult(successful=False, reason=f"node = {node_name!r}: {expected}")
    finally:
        node.destroy_node()


def _moves(node: Node, name: str) -> object:
    """Return what changes as long as node ``name`` is there or may come."""
    names = sorted(space.rstrip("/") + "/" + other for other, space in node.get_node_names_and_namespaces())
    if "/" + name.lstrip("/") in names:
        return time.monotonic()
    return names, processor_time_of((Path(name).name, COMPOSED.executable))


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
