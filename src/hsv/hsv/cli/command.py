"""The command ``hsv command``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import GraphNamespaceOption, JsonOption


def command(
    altitude: Annotated[str, typer.Argument(help="Altitude to fly to, e.g. '86000 ft'.")],
    velocity: Annotated[str, typer.Argument(help="Velocity to fly at, e.g. '8100 ft/s'.")],
    duration: Annotated[str, typer.Option(help="Least length of the ramp; default: as short as possible.")] = "0 s",
    blend: Annotated[
        str, typer.Option(help="Half the time in which climb rate and acceleration change at a corner.")
    ] = "2 s",
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Command another point of altitude and velocity in a running flight, and print the first step that changes.

    The reference becomes the fastest ramp for which the nominal trajectory stays inside U minus F Z, as with
    hsv govern. It begins as soon as earlier commands are flown. A command for which nothing fits is rejected, with the
    reason.

    Example: hsv command "86000 ft" "8100 ft/s" --blend "4 s"
    """
    from hsv.bags.description import SET_COMMAND_CLIENT
    from hsv.base.units import parse_quantity
    from hsv.graph.launcher import become

    point = parse_quantity(altitude, "m", "altitude"), parse_quantity(velocity, "m/s", "velocity")
    options = [
        *("--duration", repr(parse_quantity(duration, "s", "duration"))),
        *("--blend", repr(parse_quantity(blend, "s", "blend"))),
    ]
    flags = ["--prog", "hsv command", *(["--json"] if json else [])]
    become(SET_COMMAND_CLIENT, [*flags, *options, "--", *map(repr, point)], namespace)
