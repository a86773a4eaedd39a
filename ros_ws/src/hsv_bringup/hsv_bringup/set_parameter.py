"""Changes a parameter in flight, one of those that may: ``ros2 run hsv_bringup set_parameter tau 0.8``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter as RosParameter

from hsv.errors import ParameterError
from hsv.graph.description import NodeDescription, graph
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.parameters import Parameter
from hsv.units import parse_quantity
from hsv_bringup.client import GraphClient, OneLineParser, acting_from, answer, run_client

SETTABLE: dict[str, tuple[NodeDescription, Parameter]] = {
    parameter.name: (node, parameter)
    for node in graph()
    for parameter in NODE_PARAMETERS[node.name]
    if not parameter.read_only
}
"""Parameters that may change in flight, by name, with the node that has them."""

_STEP = re.compile(r"from step (\d+) on")


def find(name: str) -> tuple[NodeDescription, Parameter]:
    """Return the node and the parameter that a full name, or the last word of one, means.

    Raises:
        ParameterError: None that may change in flight.
    """
    found = [entry for full, entry in SETTABLE.items() if name in (full, full.rpartition(".")[2])]
    if len(found) != 1:
        raise ParameterError(f"name = {name!r}: expected a parameter that may change in flight, {', '.join(SETTABLE)}")
    return found[0]


def parse(text: str, parameter: Parameter) -> list[float]:
    """Return the value in ``text``: numbers with their units between commas, in brackets or not.

    Raises:
        QuantityError, ParameterError: It is none that the parameter takes.
    """
    words = text.strip().removeprefix("[").removesuffix("]").split(",")
    values = [parse_quantity(word, parameter.unit or "1", parameter.name) for word in words]
    return list(parameter.check(values))


def _set(client: GraphClient, options: argparse.Namespace) -> None:
    node, parameter = find(options.name)
    value = parse(options.value, parameter)
    run = client.find_run()
    request = SetParameters.Request(parameters=[RosParameter(parameter.name, value=value).to_parameter_msg()])
    response = client.call(node, SetParameters, request)
    result: SetParametersResult = response.results[0]
    if not result.successful:
        raise ParameterError(result.reason)
    step = _STEP.search(result.reason)
    assert step, "a parameter that may change in flight answers from which step on"
    time, values = acting_from(run, int(step[1]))
    named = {"node": node.name, "parameter": parameter.name, "value": value}
    answer(f"{result.reason}, {time}", named | values, options.json)


def main(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = OneLineParser(prog="set_parameter", description=__doc__)
    parser.add_argument("name", help="e.g. tau, or feedback.tau")
    parser.add_argument("value", help="e.g. 0.8, or a number for each element: 0.8,0.8,0.9,0.9,1")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    return run_client(parser, _set, args)
