"""Commands on a running graph: faults, another point of altitude and velocity, and parameters.

For example ``ros2 run hsv_bringup fault inject elevator_deflection loss_of_effectiveness effectiveness=0.8``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from math import isclose

from hsv_msgs.msg import Actuator, Reference
from hsv_msgs.srv import ClearFault, InjectFault, SetCommand
from rcl_interfaces.msg import Log, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter as RosParameter

from hsv.bags.description import FAULT_INJECTOR, NOMINAL_TRAJECTORY, ROSOUT
from hsv.bags.messages import fault_in
from hsv.base.errors import ParameterError, RunError
from hsv.graph.node_parameters import find, parse, step_in
from hsv.model.faults.injector import read_parameters
from hsv_bringup.client import GraphClient, acting_from, answer, run_client
from hsv_node.middleware import LATCHED, STEP, fault_message


def _inject(client: GraphClient, options: argparse.Namespace) -> None:
    parameters = read_parameters(",".join(options.parameters))
    fault = fault_message(options.channel, options.type, parameters)
    _change(client, options, InjectFault, InjectFault.Request(fault=fault, duration=options.duration))


def _clear(client: GraphClient, options: argparse.Namespace) -> None:
    _change(client, options, ClearFault, ClearFault.Request(channel=options.channel, type=options.type))


def _change(client: GraphClient, options: argparse.Namespace, kind: type, request: object) -> None:
    run = client.find_run()
    response = client.call(FAULT_INJECTOR, kind, request)
    if not response.success:
        raise ParameterError(response.message)
    time, values = acting_from(run, response.step)
    answer(f"{response.message}, {time}", {"message": response.message, **values}, options.json)


def _list(client: GraphClient, options: argparse.Namespace) -> None:
    run = client.find_run()
    statuses: list[Actuator] = []
    name = client.name_of(FAULT_INJECTOR, Actuator)
    client.create_subscription(Actuator, name, statuses.append, STEP)
    if not client.wait_for(lambda: statuses, f"a step ({name})"):
        raise RunError(f"no step is flown: no message on {name}")
    status = statuses[-1]
    active = [fault_in(message) for message in status.active]
    time, values = acting_from(run, status.step)
    words = "; ".join(map(str, active)) or "no fault"
    values["active"] = [{"channel": f.channel, "type": f.type, "parameters": f.parameters} for f in active]
    answer(f"step {status.step}, {time}: {words}", values, options.json)


def fault(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="fault", description="Inject, clear and list faults in flight.")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    commands = parser.add_subparsers(required=True, metavar="{inject,clear,list}")
    inject = commands.add_parser("inject", help="begin a fault with the next step")
    inject.add_argument("channel", help="e.g. elevator_deflection")
    inject.add_argument("type", help="e.g. loss_of_effectiveness")
    inject.add_argument("parameters", nargs="*", help="of the type, SI, e.g. effectiveness=0.8")
    inject.add_argument("--duration", type=float, default=0.0, help="simulated seconds; 0: until it is cleared")
    inject.set_defaults(act=_inject)
    clear = commands.add_parser("clear", help="end faults with the next step")
    clear.add_argument("channel", nargs="?", default="", help="default: all channels")
    clear.add_argument("type", nargs="?", default="", help="default: all types")
    clear.set_defaults(act=_clear)
    commands.add_parser("list", help="which faults act now").set_defaults(act=_list)
    return run_client(parser, lambda client, options: options.act(client, options), args)


def _command(client: GraphClient, options: argparse.Namespace) -> None:
    run = client.find_run()
    fields = {name: getattr(options, name) for name in ("altitude", "velocity", "duration", "blend")}
    published: list[Reference] = []
    topic = client.name_of(NOMINAL_TRAJECTORY, Reference)
    client.create_subscription(Reference, topic, published.append, LATCHED)
    logged: list[Log] = []
    client.create_subscription(Log, ROSOUT, logged.append, LATCHED)
    response = client.call(NOMINAL_TRAJECTORY, SetCommand, SetCommand.Request(**fields))
    if not response.success:
        raise ParameterError(response.message)
    time, values = acting_from(run, response.step)

    rejected = f"rejected {response.message}: "

    def reasons() -> list[str]:
        return [log.msg.removeprefix(rejected) for log in logged if log.msg.startswith(rejected)]

    def ends() -> list[float]:
        """Return the times of rest of the references that lead to this point, not those of an earlier command."""
        return [
            m.times[-1] + m.blends[-1]
            for m in published
            if (m.status, m.step) == (Reference.FLOWN, response.step)
            and isclose(m.altitudes[-1], options.altitude)
            and isclose(m.velocities[-1], options.velocity)
        ]

    def known() -> bool:
        return bool(ends() or reasons()) or not client.count_publishers(topic)

    client.wait_for(known, f"the plan ({topic})", for_ever=True)
    if not ends():
        if reasons():
            raise ParameterError(reasons()[-1])
        raise RunError("the flight has ended before the plan was known")
    end = ends()[-1]
    message = f"{response.message}, at rest at {end:.2f} s"
    answer(f"{message}, {time}", {"message": message, **values, "end_s": round(end, 9)}, options.json)


def set_command(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        prog="set_command", description="Command another point of altitude and velocity in flight."
    )
    parser.add_argument("altitude", type=float, help="m")
    parser.add_argument("velocity", type=float, help="m/s")
    parser.add_argument("--duration", type=float, default=0.0, help="least length of the ramp, s; 0: as short as fits")
    parser.add_argument(
        "--blend", type=float, default=0.0, help="half the time in which the rate changes at a corner, s; 0: 2 s"
    )
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    return run_client(parser, _command, args)


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


def set_parameter(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="set_parameter", description="Change a parameter in flight.")
    parser.add_argument("name", help="e.g. tau, or feedback.tau; real_time_factor, paused")
    parser.add_argument("value", help="e.g. 0.8, or a number for each element: 0.8,0.8,0.9,0.9,1; true or false")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    return run_client(parser, _set, args)
