"""The command ``hsv vehicles``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import print_json, print_titles


def vehicles(
    show: Annotated[
        str, typer.Option(metavar="NAME", help="Print this complete vehicle, a registered one or a file.")
    ] = "",
    json: JsonOption = False,
) -> None:
    """List the registered vehicles, or print a complete one, including everything inherited from the one it extends.

    Example: hsv vehicles --show stiffened
    """
    from hsv.model.vehicle import load_vehicle, vehicle_names, vehicle_tables, vehicle_text

    if show:
        text = vehicle_text(show)
        if json:
            print_json(vehicle_tables(show))
        else:
            print(text, end="")
        return
    titles = {name: load_vehicle(name).title for name in vehicle_names()}
    print_titles(titles, json)
