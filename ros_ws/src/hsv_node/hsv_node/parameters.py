"""Declaration of the components' parameter tables as ROS parameters of a node."""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from hsv.bags.description import CONTROLLER, CONTROLLERS
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.base.errors import DesignError, ParameterError
from hsv.base.parameters import Parameter
from hsv.model.vehicle import VEHICLE_PARAMETERS, missing_parameters, named_parameters
from hsv_node.process import ProcessNode

if TYPE_CHECKING:
    from hsv.control.design import ControlDesign

DEFAULT_DESIGN = "baseline"

_LARGEST = 2**63 - 1
"""Largest integer parameter of ROS."""


def declare(node: Node, table: Iterable[Parameter], defaults: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Declare the parameters of ``table`` that ``node`` does not have yet, and return the values of all by name.

    ``defaults``, by name (e.g. of the shipped design), replace those of the table.

    Raises:
        ParameterError: A value has the wrong type or is outside its range; the message names it.
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
            declared = _declare(node, parameter, default, empty)
        except (InvalidParameterTypeException, InvalidParameterValueException, TypeError) as error:
            raise parameter.refusal(override.value if override else default) from error
        values[parameter.name] = parameter.check(declared)
    return values


def _declare(node: Node, parameter: Parameter, default: Any, empty: bool) -> Any:
    kind = RosParameter.Type[parameter.kind.upper()]
    if empty:
        # Declare the type first, then set the value; only then may the parameter be read-only.
        node.declare_parameter(parameter.name, kind, ParameterDescriptor(), ignore_override=True)
        node.set_parameters([RosParameter(parameter.name, kind, [])])
        node.set_descriptor(parameter.name, _descriptor(parameter, kind))
        return []
    # An empty default does not determine the type of the elements: declare the type instead.
    declared = kind if default == [] else default
    return node.declare_parameter(parameter.name, declared, _descriptor(parameter)).value


def declare_vehicle(node: Node) -> None:
    """Declare the vehicle's parameters on ``node``.

    A parameter that is not given has the value of the vehicle named by ``vehicle.name``.
    """
    overrides = {p.name: node._parameter_overrides[p.name].value for p in VEHICLE_PARAMETERS if given(node, p.name)}
    # Look up the vehicle only if parameters are missing, because that imports the units.
    declare(node, VEHICLE_PARAMETERS, named_parameters(overrides) if missing_parameters(overrides) else None)


def declare_design(node: Node, extra: tuple[Parameter, ...] = ()) -> tuple[dict[str, Any], ControlDesign | None]:
    """Declare ``extra`` and the parameters of a design on ``node``; return all values by name, and the design.

    Unless ``design.name`` or ``design.hash`` is given, the defaults are those of the shipped baseline design. The
    design is None if ``design.name`` is ``none``. A warning is logged if its parameters do not match ``design.hash``.
    """
    from hsv.control.design import DESIGN_PARAMETERS, design_of
    from hsv.control.design_file import find_design, read_parameters

    # If a complete design is given (with name or hash), the shipped one need not be parsed.
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


def refuse_unknown(node: ProcessNode, role: str) -> None:
    """Raise a ParameterError if ``node`` was given an unknown parameter.

    A parameter given in a file may be that of another node or of a custom controller. One that a file gives to all
    nodes (``/**``) is ignored with a warning, as in ROS 2.

    Args:
        node: A new node, which has not declared its parameters yet.
        role: Name of its role, whose parameters it will declare; empty for a node without a role.
    """
    if not node._parameter_overrides:
        return
    from hsv.graph.node_parameters import NODE_PARAMETERS, own_parameters  # slow: imports all components

    chosen = node._parameter_overrides.get("controller")
    controller = str(chosen.value) if chosen else ""
    tables = {name: {parameter.name for parameter in table} for name, table in NODE_PARAMETERS.items()}
    if role == CONTROLLER.name:
        # A custom controller may receive every parameter of the flight.
        tables[role] = {p.name for p in own_parameters(controller)}.union(*tables.values())
    # Only its class knows the parameters of a custom controller.
    known = controller in ("", *CONTROLLERS)
    own = {*node.get_parameters_by_prefix(""), *(p.name for p in LOCKSTEP_PARAMETERS if role), *tables.get(role, ())}
    ignored: list[str] = []
    for name in node._parameter_overrides:
        owner = next((other for other, names in tables.items() if name in names), "")
        if name in own or (name not in node.own_only and (owner or not known)):
            continue
        admitted = own if name in node.own_only else own.union(*tables.values())
        [nearest] = difflib.get_close_matches(name, admitted, 1, 0.0)
        of = f", {owner} has" if owner else ""
        words = f"parameter {name}: {node.get_name()} has none of this name{of}; nearest is {nearest}"
        if name in node.own_only or not _for_all_nodes(node, name):
            raise ParameterError(words)
        ignored.append(words)
    if ignored:
        node.get_logger().warning(f"ignored: {'; '.join(ignored)}")


def _for_all_nodes(node: ProcessNode, name: str) -> bool:
    """Return whether a parameter file of the process gives the parameter ``name`` in a section with wildcards."""
    from hsv.base.files import read_text
    from hsv.control.design_file import parse_sections

    files = [parse_sections(read_text(Path(file)), file) for file in node.parameter_files]
    return any("*" in section and name in flat for sections in files for section, flat in sections.items())


def _descriptor(parameter: Parameter, kind: RosParameter.Type | None = None) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=parameter.description + unit,
        read_only=parameter.read_only,
        additional_constraints=parameter.constraint,
    )
    if kind is not None:
        descriptor.type = kind.value
    # ROS ranges are for single numbers and have two ends; for lists, the constraint in words applies.
    limits = parameter.minimum, parameter.maximum
    if any(map(math.isfinite, limits)):
        largest = sys.float_info.max if parameter.kind == "double" else _LARGEST
        low, high = (min(max(limit, -largest), largest) for limit in limits)
        if parameter.kind == "double":
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high, step=0.0)]
        elif parameter.kind == "integer":
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=1)]
    return descriptor
