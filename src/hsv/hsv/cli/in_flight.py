"""Commands on a running flight: each becomes a client node of the graph, no matter how the graph was started."""

from __future__ import annotations

from json import dumps
from typing import Annotated, Any, NoReturn

import typer
from typer import Argument, Option

from hsv.base.errors import ParameterError
from hsv.base.units import UnitSystem, parse_quantity
from hsv.cli.options import GraphNamespaceOption, Group, JsonOption, UnitsOption

fault = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    help="""Inject, clear and list faults in a running flight, no matter how it was started.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8""",
)


@fault.command(context_settings={"ignore_unknown_options": True})  # a negative value is no option
def inject(
    channel: Annotated[str, Argument(help="What fails, e.g. elevator_deflection, engine, pitch_rate.")],
    type: Annotated[str, Argument(help="Type of the fault, e.g. loss_of_effectiveness.")],
    parameters: Annotated[
        list[str] | None, Argument(help="Its parameters, 'amplitude=1 deg'; a single one as 0.8.")
    ] = None,
    duration: Annotated[str, Option(help="Simulated time until it ends, '5 s'; default: until cleared.")] = "0 s",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Start a fault from the next step on, and print this step. hsv list faults lists the types.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8 --duration "5 s"
    """
    from hsv.base.parameters import read_number
    from hsv.model.faults.injector import DURATION
    from hsv.model.faults.table import read_fault

    found = read_fault(channel, type, parameters or [])
    seconds = read_number(DURATION, duration, "duration")
    options = {"channel": channel, "type": type, "parameters": found.parameters, "duration": seconds}
    _become("fault_inject", namespace, json=json, **options)


@fault.command()
def clear(
    channel: Annotated[str, Argument(help="What fails; default: everything.")] = "",
    type: Annotated[str, Argument(help="Type of the fault; default: all of them.")] = "",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """End the faults of one channel or of all channels from the next step on.

    Example: hsv fault clear elevator_deflection
    """
    _become("fault_clear", namespace, json=json, channel=channel, type=type)


@fault.command(name="list")
def list_(namespace: GraphNamespaceOption = "", json: JsonOption = False) -> None:
    """List the active faults.

    Example: hsv fault list --json
    """
    _become("fault_list", namespace, json=json)


def set_(
    name: Annotated[str, Argument(help="Parameter that may change in flight: tau (feedback.tau).")],
    value: Annotated[str, Argument(help="Its value, with a unit where it has one: 0.8, or 0.8,0.8,0.9,0.9,1.")],
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Change a parameter of a running flight from the next step on.

    Example: hsv set tau 0.8
    """
    _become("set", namespace, json=json, name=name, value=value)


def command(
    altitude: Annotated[str, Argument(help="Altitude to fly to, e.g. '86000 ft'.")],
    velocity: Annotated[str, Argument(help="Velocity to fly at, e.g. '8100 ft/s'.")],
    duration: Annotated[str, Option(help="Least length of the ramp; default: as short as possible.")] = "0 s",
    blend: Annotated[str, Option(help="Half the time of a change of climb rate and acceleration.")] = "2 s",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Command another point of altitude and velocity in a running flight, and print the first step that changes.

    The reference becomes the fastest ramp for which the nominal trajectory stays inside U minus F Z, as with
    hsv govern. It begins as soon as earlier commands are flown. A command for which nothing fits is rejected, with the
    reason.

    Example: hsv command "86000 ft" "8100 ft/s" --blend "4 s"
    """
    given = {
        "altitude": (altitude, "m"),
        "velocity": (velocity, "m/s"),
        "duration": (duration, "s"),
        "blend": (blend, "s"),
    }
    numbers = {name: parse_quantity(text, unit, name) for name, (text, unit) in given.items()}
    _become("command", namespace, json=json, **numbers)


def watch(
    namespace: GraphNamespaceOption = "", units: UnitsOption = UnitSystem.metric, json: JsonOption = False
) -> None:
    """Show the current state of a running flight, no matter how it was started, on a line that is updated.

    The graph never waits for this command. With --json, or into a file, at most five lines per second are printed.

    Example: hsv watch --units paper
    """
    _become("watch", namespace, json=json, units=units)


def topic(
    name: Annotated[str, Argument(help="Topic, e.g. /hsv/state; default: list the topics.")] = "",
    once: Annotated[bool, Option("--once", help="Print one message only.")] = False,
    every: Annotated[int, Option(min=1, help="Print every N-th message.")] = 1,
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Print the messages of a topic of a running graph, with units, until its publisher is gone.

    Without a topic: list the topics with their types, publishers and subscribers. With --json: one object per line.

    Example: hsv topic /hsv/state --every 50
    """
    if not name and (once or every > 1):
        option = "once" if once else f"every = {every}"
        raise ParameterError(f"{option}: expected with a topic only")
    _become("topic", namespace, json=json, name=name, once=once, every=every)


def _become(command: str, namespace: str, **options: Any) -> NoReturn:
    """Replace this process by the client node, which executes ``command`` (see ``hsv_bringup.commands``)."""
    from hsv.bags.description import CLIENT
    from hsv.graph.launcher import become

    become(CLIENT, [command, dumps(options)], namespace)
