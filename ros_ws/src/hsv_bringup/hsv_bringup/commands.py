"""Commands of ``hsv`` on a running graph: faults, commands of altitude and velocity, parameters, topics, status."""

from __future__ import annotations

import json
import sys
from math import isclose
from types import SimpleNamespace

from hsv_msgs.msg import Actuator, Reference
from hsv_msgs.srv import ClearFault, InjectFault, SetCommand
from rcl_interfaces.msg import Log, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter as RosParameter

from hsv.bags.description import FAULT_INJECTOR, NOMINAL_TRAJECTORY, ROSOUT
from hsv.bags.messages import fault_in
from hsv.base.errors import ParameterError, RunError
from hsv.graph.node_parameters import find, parse, step_in
from hsv_bringup.client import GraphClient, acting_from, answer, run_client
from hsv_bringup.topic import print_topic
from hsv_bringup.watch import watch_flight
from hsv_node.middleware import LATCHED, STEP, fault_message


def _inject(client: GraphClient, options: SimpleNamespace) -> None:
    fault = fault_message(options.channel, options.type, options.parameters)
    _change(client, options, InjectFault, InjectFault.Request(fault=fault, duration=options.duration))


def _clear(client: GraphClient, options: SimpleNamespace) -> None:
    _change(client, options, ClearFault, ClearFault.Request(channel=options.channel, type=options.type))


def _change(client: GraphClient, options: SimpleNamespace, kind: type, request: object) -> None:
    run = client.find_run()
    response = client.call(FAULT_INJECTOR, kind, request)
    if not response.success:
        raise ParameterError(response.message)
    time, values = acting_from(client, run, response.step)
    answer(f"{response.message}, {time}", {"message": response.message, **values}, options.json)


def _list(client: GraphClient, options: SimpleNamespace) -> None:
    run = client.find_run()
    statuses: list[Actuator] = []
    name = client.name_of(FAULT_INJECTOR, Actuator)
    client.create_subscription(Actuator, name, statuses.append, STEP)
    if not client.wait_for(lambda: statuses, f"a step ({name})"):
        raise RunError(f"no step is flown: no message on {name}")
    status = statuses[-1]
    active = [fault_in(message) for message in status.active]
    time, values = acting_from(client, run, status.step)
    words = "; ".join(map(str, active)) or "no fault"
    values["active"] = [{"channel": f.channel, "type": f.type, "parameters": f.parameters} for f in active]
    answer(f"step {status.step}, {time}: {words}", values, options.json)


def _command(client: GraphClient, options: SimpleNamespace) -> None:
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
    time, values = acting_from(client, run, response.step)

    rejected = f"rejected {response.message}: "

    def reasons() -> list[str]:
        return [log.msg.removeprefix(rejected) for log in logged if log.msg.startswith(rejected)]

    def ends() -> list[float]:
        """Return the times (s) at which the references published for this command reach its target."""
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


def _set(client: GraphClient, options: SimpleNamespace) -> None:
    node, parameter = find(options.name)
    value = parse(options.value, parameter)
    run = client.find_run()
    request = SetParameters.Request(parameters=[RosParameter(parameter.name, value=value).to_parameter_msg()])
    response = client.call(node, SetParameters, request)
    result: SetParametersResult = response.results[0]
    if not result.successful:
        raise ParameterError(result.reason)
    time, values = acting_from(client, run, step_in(result.reason))
    named = {"node": node.name, "parameter": parameter.name, "value": value}
    answer(f"{result.reason}, {time}", named | values, options.json)


ACTIONS = {
    "fault_inject": _inject,
    "fault_clear": _clear,
    "fault_list": _list,
    "command": _command,
    "set": _set,
    "topic": print_topic,
    "watch": watch_flight,
}


def main() -> int:
    """Run the command that argument 1 names; argument 2 has its options as JSON, see :mod:`hsv.cli.in_flight`."""
    name, options = sys.argv[1:3]
    return run_client(name, ACTIONS[name], SimpleNamespace(**json.loads(options)))
