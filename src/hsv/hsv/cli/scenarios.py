"""The command ``hsv scenarios``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption
from hsv.cli.output import print_json, print_titles


def scenarios(
    show: Annotated[
        str, typer.Option(metavar="NAME", help="Print this complete scenario, a shipped one or a file.")
    ] = "",
    json: JsonOption = False,
) -> None:
    """List the shipped scenarios, or print a complete one, including everything inherited from the one it extends.

    Example: hsv scenarios --show case2_derived
    """
    from hsv.flight.scenario import (
        load_scenario,
        scenario_at_means,
        scenario_names,
        scenario_table,
        scenario_text,
    )

    if show:
        text = scenario_text(show)
        name = Path(show).stem
        table = scenario_table(text, name)
        scenario_at_means(table, name)
        if json:
            print_json(table)
        else:
            print(text, end="")
        return
    titles = {name: load_scenario(name).title for name in scenario_names()}
    print_titles(titles, json)
