"""Changes a parameter in flight, one of those that may: ``ros2 run hsv_bringup set_parameter tau 0.8``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter as RosParameter

from hsv.base.errors import ParameterError
from hsv.graph.settable import find, parse, step_in
from hsv_bringup.client import GraphClient, OneLineParser, acting_from, answer, run_client


def _set(client: GraphClient, options: argparse.Namespace) -> None:
    node, parameter = find(options.name)
    value = parse(options.value, parameter)
    run = client.find_run()
    request = SetParameters.Request(parameters=[RosParameter(parameter.name, value=value).to_parameter_msg()])
    response = client.call(node, SetParameters, request)
    result: SetParametersResult = response.results[0]
    if not result.successful:
        raise ParameterError(result.reason)
    time, values = acting_from(run, step_in(result.reason))
    named = {"node": node.name, "parameter": parameter.name, "value": value}
    answer(f"{result.reason}, {time}", named | values, options.json)


def main(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = OneLineParser(prog="set_parameter", description=__doc__)
    parser.add_argument("name", help="e.g. tau, or feedback.tau; real_time_factor, paused")
    parser.add_argument("value", help="e.g. 0.8, or a number for each element: 0.8,0.8,0.9,0.9,1; true or false")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    return run_client(parser, _set, args)
