"""Declaring a controller design on a node."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from hsv.control.design_file import DESIGN_PARAMETERS, digest, find_design, read_parameters
from hsv.errors import DesignError
from hsv.parameters import Parameter
from hsv_node.parameters import declare

DEFAULT_DESIGN = "baseline"


def declare_design(node: Node, extra: tuple[Parameter, ...] = ()) -> dict[str, Any]:
    """Declare ``extra`` and the design's parameters on ``node``, the shipped baseline as default; return their values.

    A design that was changed since it was written is told in a warning: people tune.
    """
    try:
        shipped = read_parameters(find_design(DEFAULT_DESIGN))
    except DesignError as error:
        node.get_logger().debug(f"no default design: {error}")
        shipped = {}
    values = declare(node, (*extra, *DESIGN_PARAMETERS), shipped)
    if values["design.hash"] != digest(values):
        node.get_logger().warning(f"design {values['design.name']!r}: modified since design")
    return values
