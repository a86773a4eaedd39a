"""The commands ``hsv fault inject``, ``clear`` and ``list``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from hsv.cli.options import GraphNamespaceOption, JsonOption

fault = typer.Typer(
    no_args_is_help=True,
    help="""Inject, clear and list faults of the actuators in a flight that is on its way, whoever has started it.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8""",
)


@fault.command(context_settings={"ignore_unknown_options": True})  # a value below zero is none
def inject(
    channel: Annotated[str, typer.Argument(help="Actuator, e.g. elevator_deflection.")],
    type: Annotated[str, typer.Argument(help="Type of the fault, e.g. loss_of_effectiveness.")],
    value: Annotated[str, typer.Argument(help="Value of the type: 0.8 or '80 %' of the effectiveness is left.")],
    duration: Annotated[
        str, typer.Option(help="Simulated time after which it ends, such as '5 s'; default: until it is cleared.")
    ] = "0 s",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Begin a fault with the next step that is not flown yet; the answer says which one.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8 --duration "5 s"
    """
    from hsv.units import parse_quantity

    share, time = parse_quantity(value, "1", "value"), parse_quantity(duration, "s", "duration")
    options = ["--duration", repr(time)]
    _ask("inject", channel, type, repr(share), options=options, namespace=namespace, json=json)


@fault.command()
def clear(
    channel: Annotated[str, typer.Argument(help="Actuator; default: all of them.")] = "",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """End the faults of an actuator, or of all, with the next step that is not flown yet.

    Example: hsv fault clear elevator_deflection
    """
    _ask("clear", *([channel] if channel else []), namespace=namespace, json=json)


@fault.command(name="list")
def list_(namespace: GraphNamespaceOption = "", json: JsonOption = False) -> None:
    """Show which faults act now.

    Example: hsv fault list --json
    """
    _ask("list", namespace=namespace, json=json)


def _ask(*words: str, options: Sequence[str] = (), namespace: str, json: bool) -> None:
    from hsv.graph.description import FAULT
    from hsv.graph.launcher import become

    # Behind the dashes stand words, also those that begin with one, as a value below zero.
    command, *values = words
    flags = ["--prog", "hsv fault", *(["--json"] if json else [])]
    become(FAULT, [*flags, command, *options, *(["--", *values] if values else [])], namespace)
