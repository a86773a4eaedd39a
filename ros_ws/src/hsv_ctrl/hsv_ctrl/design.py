"""Declare the parameters of a controller design on a node."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from hsv.base.errors import DesignError
from hsv.base.parameters import Parameter
from hsv.control.design import DESIGN_PARAMETERS, ControlDesign, design_of, find_design, read_parameters
from hsv_node.parameters import declare, given

DEFAULT_DESIGN = "baseline"


def declare_design(node: Node, extra: tuple[Parameter, ...] = ()) -> tuple[dict[str, Any], ControlDesign | None]:
    """Declare ``extra`` and the design's parameters on ``node``; return the values of all, and the design in them.

    A design that is not given is the shipped baseline; ``design.name`` none is to fly without one. One that was changed
    since it was written is told in a warning: people tune.

    Raises:
        ParameterError, DesignError: A wrong value, named.
    """
    # A whole design is known by its digest: there is nothing to fill in, and the shipped one need not be parsed.
    whole = given(node, "design.hash") or given(node, "design.name")
    values = declare(node, (*extra, *DESIGN_PARAMETERS), {} if whole else _shipped(node))
    design = design_of(values)
    if design and design.modified:
        node.get_logger().warning(f"design {design.name!r}: modified since design")
    return values, design


def _shipped(node: Node) -> dict[str, Any]:
    try:
        return read_parameters(find_design(DEFAULT_DESIGN))
    except DesignError as error:
        node.get_logger().debug(f"no default design: {error}")
        return {}
