"""The command ``hsv scenarios``."""

from __future__ import annotations

from rich.text import Text

from hsv.cli.options import JsonOption
from hsv.cli.output import console, print_json


def scenarios(json: JsonOption = False) -> None:
    """List the shipped scenarios.

    Example: hsv scenarios
    """
    from hsv.simulation.scenario import load_scenario, scenario_names

    titles = {name: load_scenario(name).title for name in scenario_names()}
    if json:
        print_json(titles)
        return
    width = max(map(len, titles))
    for name, title in titles.items():
        console.print(Text.assemble((f"{name:{width}}", "bold"), f"  {title}"))
