"""The commands ``hsv fault inject``, ``clear`` and ``list``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from hsv.cli.options import GraphNamespaceOption, JsonOption

fault = typer.Typer(
    no_args_is_help=True,
    help="""Inject, clear and list faults in a running flight, no matter how it was started.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8""",
)


@fault.command(context_settings={"ignore_unknown_options": True})  # a value below zero is none
def inject(
    channel: Annotated[str, typer.Argument(help="What fails, e.g. elevator_deflection, engine, pitch_rate.")],
    type: Annotated[str, typer.Argument(help="Type of the fault, e.g. loss_of_effectiveness.")],
    parameters: Annotated[
        list[str] | None,
        typer.Argument(help="Parameters of the type, e.g. 'amplitude=1 deg' 'frequency=2 Hz'; a single one as 0.8."),
    ] = None,
    duration: Annotated[
        str, typer.Option(help="Simulated time after which the fault ends, e.g. '5 s'; default: until it is cleared.")
    ] = "0 s",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Start a fault at the next step that is not flown yet, and print this step. hsv faults lists the types.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8 --duration "5 s"
    """
    from hsv.base.units import parse_quantity
    from hsv.model.faults.table import read_fault

    found = read_fault(channel, type, parameters or [])
    options = ["--duration", repr(parse_quantity(duration, "s", "duration"))]
    given = [f"{name}={value!r}" for name, value in found.parameters.items()]
    _ask("inject", channel, type, *given, options=options, namespace=namespace, json=json)


@fault.command()
def clear(
    channel: Annotated[str, typer.Argument(help="What fails; default: everything.")] = "",
    type: Annotated[str, typer.Argument(help="Type of the fault; default: all of them.")] = "",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """End the faults of one channel or of all channels at the next step that is not flown yet.

    Example: hsv fault clear elevator_deflection
    """
    _ask("clear", *filter(None, (channel, type)), namespace=namespace, json=json)


@fault.command(name="list")
def list_(namespace: GraphNamespaceOption = "", json: JsonOption = False) -> None:
    """List the active faults.

    Example: hsv fault list --json
    """
    _ask("list", namespace=namespace, json=json)


def _ask(*words: str, options: Sequence[str] = (), namespace: str, json: bool) -> None:
    from hsv.bags.description import FAULT
    from hsv.graph.launcher import become

    # Behind the dashes stand words, also those that begin with one, as a value below zero.
    command, *values = words
    flags = ["--prog", "hsv fault", *(["--json"] if json else [])]
    become(FAULT, [*flags, command, *options, *(["--", *values] if values else [])], namespace)
