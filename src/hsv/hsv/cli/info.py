"""The command ``hsv info``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption, UnitsOption
from hsv.cli.output import Units, console, print_json, print_table, to_json


def info(
    bag: Annotated[Path, typer.Argument(help="Bag directory, or its .mcap file.")],
    units: UnitsOption = Units.si,
    json: JsonOption = False,
) -> None:
    """What a bag holds: duration, topics, scenario, design, faults, metrics.

    Example: hsv info bags/case1_20260101T000000Z
    """
    from hsv.recording.flight import flight_data
    from hsv.recording.info import describe
    from hsv.recording.reader import Bag
    from hsv.simulation.metrics import METRICS, flight_metrics

    opened = Bag(bag)
    description = describe(opened)
    quantities = {name: (value, METRICS[name].unit) for name, value in flight_metrics(flight_data(opened)).items()}
    if json:
        print_json(description | {"metrics": to_json(quantities, units)})
        return
    from rich.table import Table

    for key in ("path", "duration_s"):
        if key in description:
            console.print(f"{key:12} {description[key]}", soft_wrap=True)
    for key, value in description["custom_data"].items():
        console.print(f"{key:12} {value}", soft_wrap=True)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("topic", "type", "messages", "rate Hz"):
        table.add_column(column, justify="right" if column in ("messages", "rate Hz") else "left")
    for topic in description["topics"]:
        table.add_row(topic["name"], topic["type"], str(topic["messages"]), f"{topic['rate_hz'] or 0:.4g}")
    console.print(table)
    print_table("Metrics", quantities, units)
