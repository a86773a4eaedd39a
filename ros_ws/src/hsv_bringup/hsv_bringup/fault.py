"""Injects, clears and lists faults in flight: ``ros2 run hsv_bringup fault inject elevator_deflection ...``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from hsv_msgs.msg import Actuator, Fault
from hsv_msgs.srv import ClearFault, InjectFault

from hsv.bags.description import FAULT_INJECTOR
from hsv.bags.messages import fault_in
from hsv.base.errors import ParameterError, RunError
from hsv.model.faults.injector import read_parameters
from hsv_bringup.client import GraphClient, OneLineParser, acting_from, answer, run_client
from hsv_node.qos import STEP


def _inject(client: GraphClient, options: argparse.Namespace) -> None:
    parameters = read_parameters(",".join(options.parameters))
    fault = Fault(
        channel=options.channel,
        type=options.type,
        parameter_names=list(parameters),
        parameter_values=list(parameters.values()),
    )
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
    name = client.topic_of(FAULT_INJECTOR, Actuator)
    client.create_subscription(Actuator, name, statuses.append, STEP)
    if not client.wait_for(lambda: statuses, f"a step ({name})"):
        raise RunError(f"no step is flown: no message on {name}")
    status = statuses[-1]
    active = [fault_in(message) for message in status.active]
    time, values = acting_from(run, status.step)
    words = "; ".join(map(str, active)) or "no fault"
    described = [{"channel": f.channel, "type": f.type, "parameters": f.parameters} for f in active]
    answer(f"step {status.step}, {time}: {words}", {**values, "active": described}, options.json)


def main(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = OneLineParser(prog="fault", description="Inject, clear and list faults in flight.")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    commands = parser.add_subparsers(required=True, metavar="{inject,clear,list}", parser_class=OneLineParser)
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
