"""Declaring a component's parameter table on a node."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from hsv.errors import ParameterError
from hsv.parameters import Parameter


def declare(node: Node, table: Iterable[Parameter], defaults: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Declare every parameter of ``table`` on ``node`` and return the checked values.

    ``defaults`` (e.g. the shipped design) stand in for the table's own.

    Raises:
        ParameterError: A value of the wrong type or outside its range, named.
    """
    values = {}
    for parameter in table:
        if node.has_parameter(parameter.name):
            values[parameter.name] = node.get_parameter(parameter.name).value
            continue
        default = (defaults or {}).get(parameter.name, parameter.default)
        try:
            # An empty list has no element type in ROS 2: it is declared by type, and set only if somebody gives it.
            value = default if default != [] else None
            declared = node.declare_parameter(parameter.name, value, _descriptor(parameter))
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            given = node._parameter_overrides[parameter.name].value
            raise ParameterError(
                f"parameter {parameter.name} = {_short(given)}: expected {parameter.constraint}"
            ) from error
        values[parameter.name] = parameter.check(declared.value if declared.value is not None else [])
    return values


def given(node: Node, name: str) -> bool:
    """Return whether the parameter ``name`` was given to ``node`` at its start, in a file or on the command line."""
    return name in node._parameter_overrides


def refuse_sim_time(node: Node) -> None:
    """Keep a node that makes the clock from going by it.

    Raises:
        ParameterError: It was given ``use_sim_time``.
    """
    refusal = f"parameter use_sim_time = True: expected false for {node.get_name()}, which makes the clock itself"
    if node.get_parameter("use_sim_time").value:
        raise ParameterError(refusal)

    def check(parameters: list[RosParameter]) -> SetParametersResult:
        given = any(parameter.name == "use_sim_time" and parameter.value for parameter in parameters)
        return SetParametersResult(successful=not given, reason=refusal if given else "")

    node.add_on_set_parameters_callback(check)


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=parameter.description + unit,
        read_only=parameter.read_only,
        additional_constraints=parameter.constraint,
        dynamic_typing=parameter.default == [],
    )
    if math.isfinite(parameter.minimum) and math.isfinite(parameter.maximum):
        if parameter.kind == "double":
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=parameter.minimum, to_value=parameter.maximum, step=0.0)
            ]
        elif parameter.kind == "integer":
            descriptor.integer_range = [
                IntegerRange(from_value=int(parameter.minimum), to_value=int(parameter.maximum), step=1)
            ]
    return descriptor


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
