"""Parameters as nodes declare them to ROS: types, ranges, descriptions; and which can be changed in flight."""

import math
import sys

import pytest
import rclpy
from rclpy.context import Context
from ros_domain import own_domain

from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv_node.parameters import declare

pytestmark = pytest.mark.graph

ALL = {p.name: p for table in (*NODE_PARAMETERS.values(), LOCKSTEP_PARAMETERS) for p in table}


@pytest.fixture(scope="module")
def context():
    """Return an rclpy context in its own domain."""
    with own_domain() as domain:
        made = Context()
        rclpy.init(args=[], context=made, domain_id=domain)
        yield made
        made.try_shutdown()


@pytest.fixture(scope="module")
def declared(context):
    """Return a node that declares the parameters of all nodes."""
    node = rclpy.create_node("declared", context=context)
    declare(node, ALL.values())
    yield node
    node.destroy_node()


@pytest.mark.parametrize("parameter", ALL.values(), ids=ALL)
def test_descriptors_are_complete_and_values_typed(declared, parameter):
    descriptor = declared.describe_parameter(parameter.name)
    value = declared.get_parameter(parameter.name)
    assert value.type_.name.lower() == parameter.kind and descriptor.type == value.type_.value
    assert descriptor.description.startswith(parameter.description)
    assert descriptor.additional_constraints == parameter.constraint != ""
    assert descriptor.read_only == parameter.read_only and not descriptor.dynamic_typing
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    ends = [end for end in (parameter.minimum, parameter.maximum) if math.isfinite(end)]
    assert len(ranges) == (bool(ends) and not parameter.kind.endswith("_array"))
    for given in ranges:
        found = [end for end in (given.from_value, given.to_value) if abs(end) < min(sys.float_info.max, 2**63 - 1)]
        assert found == ends
