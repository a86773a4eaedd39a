"""Commands on a running flight: each becomes a client node that talks to the graph, however that was started."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, NoReturn

import typer
from typer import Argument, Option

from hsv.base.errors import ParameterError
from hsv.base.units import UnitSystem, parse_quantity
from hsv.cli.options import GraphNamespaceOption, JsonOption, UnitsOption

fault = typer.Typer(
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
    """Start a fault at the next step that is not flown yet, and print this step. hsv list faults lists the types.

    Example: hsv fault inject elevator_deflection loss_of_effectiveness 0.8 --duration "5 s"
    """
    from hsv.base.parameters import read_number
    from hsv.model.faults.injector import DURATION
    from hsv.model.faults.table import read_fault

    found = read_fault(channel, type, parameters or [])
    given = [f"{name}={value!r}" for name, value in found.parameters.items()]
    options = ["inject", "--duration", repr(read_number(DURATION, duration, "duration"))]
    _become("FAULT", "fault", options, [channel, type, *given], namespace, json)


@fault.command()
def clear(
    channel: Annotated[str, Argument(help="What fails; default: everything.")] = "",
    type: Annotated[str, Argument(help="Type of the fault; default: all of them.")] = "",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """End the faults of one channel or of all channels at the next step that is not flown yet.

    Example: hsv fault clear elevator_deflection
    """
    _become("FAULT", "fault", ["clear"], filter(None, (channel, type)), namespace, json)


@fault.command(name="list")
def list_(namespace: GraphNamespaceOption = "", json: JsonOption = False) -> None:
    """List the active faults.

    Example: hsv fault list --json
    """
    _become("FAULT", "fault", ["list"], (), namespace, json)


def set_(
    name: Annotated[str, Argument(help="Parameter that may change in flight: tau (feedback.tau).")],
    value: Annotated[str, Argument(help="Its value, with a unit where it has one: 0.8, or 0.8,0.8,0.9,0.9,1.")],
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Change a parameter of a running flight at the next step that is not flown yet.

    Example: hsv set tau 0.8
    """
    _become("SET_PARAMETER", "set", (), (name, value), namespace, json)


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
    point = parse_quantity(altitude, "m", "altitude"), parse_quantity(velocity, "m/s", "velocity")
    length, half = parse_quantity(duration, "s", "duration"), parse_quantity(blend, "s", "blend")
    _become(
        "SET_COMMAND_CLIENT",
        "command",
        ["--duration", repr(length), "--blend", repr(half)],
        map(repr, point),
        namespace,
        json,
    )


def watch(
    namespace: GraphNamespaceOption = "", units: UnitsOption = UnitSystem.metric, json: JsonOption = False
) -> None:
    """Show the current state of a running flight, no matter how it was started, on a line that is updated.

    The graph never waits for this command. With --json, or into a file, at most five lines per second are printed.

    Example: hsv watch --units paper
    """
    _become("WATCH", "watch", ["--units", units], (), namespace, json)


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
    options = [*(["--once"] if once else []), "--every", str(every)]
    _become("TOPIC", "topic", options, filter(None, [name]), namespace, json)


def _become(
    node: str, command: str, options: Sequence[str], values: Iterable[str], namespace: str, json: bool
) -> NoReturn:
    """Run a client node, named in :mod:`hsv.bags.description`, in place of this process.

    If the client has commands of its own, one of them heads the ``options``.
    """
    from hsv.bags import description
    from hsv.graph.launcher import become

    words = ["--prog", f"hsv {command}", *(["--json"] if json else []), *options]
    values = list(values)
    # Some values begin with a dash themselves, as negative numbers do.
    become(getattr(description, node), [*words, *(["--", *values] if values else [])], namespace)
