"""Declaring a component's parameter table on a node."""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from hsv.bags.description import CONTROLLER, CONTROLLERS
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.base.errors import DesignError, ParameterError
from hsv.base.parameters import Parameter
from hsv.model.vehicle import VEHICLE_PARAMETERS, missing_parameters, named_parameters

if TYPE_CHECKING:
    from hsv.control.design import ControlDesign

DEFAULT_DESIGN = "baseline"

_LARGEST = 2**63 - 1
"""Largest integer parameter of ROS."""


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
        override = node._parameter_overrides.get(parameter.name)
        # Neither YAML nor rclpy can tell the element type of an empty list.
        empty = parameter.kind.endswith("_array") and (default == [] if override is None else override.value is None)
        try:
            declared = _declare_empty(node, parameter) if empty else _declare(node, parameter, default)
        except (InvalidParameterTypeException, InvalidParameterValueException, TypeError) as error:
            raise parameter.refusal(override.value if override else default) from error
        values[parameter.name] = parameter.check(declared)
    return values


def _declare(node: Node, parameter: Parameter, default: Any) -> Any:
    # A given value must have the type that an empty default cannot tell.
    declared = _array_type(parameter) if default == [] else default
    return node.declare_parameter(parameter.name, declared, _descriptor(parameter)).value


def _array_type(parameter: Parameter) -> RosParameter.Type:
    return RosParameter.Type.STRING_ARRAY if parameter.kind == "string_array" else RosParameter.Type.DOUBLE_ARRAY


def _declare_empty(node: Node, parameter: Parameter) -> Any:
    kind = _array_type(parameter)
    # Declare the type first, then set the value; only then may the parameter be read-only.
    node.declare_parameter(parameter.name, kind, ParameterDescriptor(), ignore_override=True)
    node.set_parameters([RosParameter(parameter.name, kind, [])])
    node.set_descriptor(parameter.name, _descriptor(parameter, kind))
    return []


def declare_vehicle(node: Node) -> None:
    """Declare the vehicle's parameters on ``node``.

    A parameter that is not given has the value of the vehicle named by ``vehicle.name``.
    """
    # Skip the look-up for a vehicle that is given completely, because importing the units takes time.
    overrides = {p.name: node._parameter_overrides[p.name].value for p in VEHICLE_PARAMETERS if given(node, p.name)}
    declare(node, VEHICLE_PARAMETERS, named_parameters(overrides) if missing_parameters(overrides) else None)


def declare_design(node: Node, extra: tuple[Parameter, ...] = ()) -> tuple[dict[str, Any], ControlDesign | None]:
    """Declare ``extra`` and the parameters of a design on ``node``; return all values and the design in them.

    Without parameters of a design the shipped one is used; ``design.name`` none flies without one. A warning says that
    a design was modified since it was designed.
    """
    from hsv.control.design import DESIGN_PARAMETERS, design_of, find_design, read_parameters

    # A complete design is known by its digest; the shipped one then need not be parsed.
    whole = given(node, "design.hash") or given(node, "design.name")
    shipped: dict[str, Any] = {}
    with suppress(DesignError):  # an installation without designs
        shipped = {} if whole else read_parameters(find_design(DEFAULT_DESIGN))
    values = declare(node, (*extra, *DESIGN_PARAMETERS), shipped)
    design = design_of(values)
    if design and design.modified:
        node.get_logger().warning(f"design {design.name!r}: modified since design")
    return values, design


def given(node: Node, name: str) -> bool:
    """Return whether the parameter ``name`` was given to ``node`` in a file or on the command line."""
    return name in node._parameter_overrides


def refuse_sim_time(node: Node) -> None:
    """Refuse ``use_sim_time`` for a node that publishes the clock."""
    refusal = f"parameter use_sim_time = True: expected false for {node.get_name()}, which makes the clock itself"
    if node.get_parameter("use_sim_time").value:
        raise ParameterError(refusal)

    def check(parameters: list[RosParameter]) -> SetParametersResult:
        given = any(parameter.name == "use_sim_time" and parameter.value for parameter in parameters)
        return SetParametersResult(successful=not given, reason=refusal if given else "")

    node.add_on_set_parameters_callback(check)


def refuse_unknown(node: Node, role: str, of_others: frozenset[str]) -> None:
    """Refuse parameters given to ``node`` that it does not have.

    Args:
        node: A new node, with no more than what ROS has declared.
        role: Its role, whose parameters it will declare; empty for none.
        of_others: Names that may be there for other nodes of the graph: the files of a run address all of them.
    """
    if not node._parameter_overrides:
        return
    from hsv.graph.node_parameters import NODE_PARAMETERS, own_parameters  # all components, for who is given something

    chosen = node._parameter_overrides.get("controller")
    controller = str(chosen.value) if chosen else ""
    tables = {name: {parameter.name for parameter in table} for name, table in NODE_PARAMETERS.items()}
    if role == CONTROLLER.name:
        # A custom controller may receive every parameter of the flight.
        tables[role] = {p.name for p in own_parameters(controller)}.union(*tables.values())
    # The parameters of a custom controller are known to its class only.
    known = controller in ("", *CONTROLLERS)
    own = {*node.get_parameters_by_prefix(""), *(p.name for p in LOCKSTEP_PARAMETERS if role), *tables.get(role, ())}
    for name in node._parameter_overrides:
        owner = next((other for other, names in tables.items() if name in names), "")
        if name in own or (name in of_others and (owner or not known)):
            continue
        nearest = difflib.get_close_matches(name, own.union(*tables.values()) if name in of_others else own, 1, 0.0)
        of = f", {owner} has" if owner else ""
        raise ParameterError(f"parameter {name}: {node.get_name()} has none of this name{of}; nearest is {nearest[0]}")


def _descriptor(parameter: Parameter, kind: RosParameter.Type | None = None) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=parameter.description + unit,
        read_only=parameter.read_only,
        additional_constraints=parameter.constraint,
    )
    if kind is not None:
        descriptor.type = kind.value
    # ROS has ranges for single numbers only, with two ends; the constraint in words covers lists.
    limits = parameter.minimum, parameter.maximum
    if parameter.kind == "double" and any(map(math.isfinite, limits)):
        low, high = (min(max(limit, -sys.float_info.max), sys.float_info.max) for limit in limits)
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high, step=0.0)]
    elif parameter.kind == "integer" and any(map(math.isfinite, limits)):
        low, high = (int(min(max(limit, -_LARGEST), _LARGEST)) for limit in limits)
        descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=1)]
    return descriptor
