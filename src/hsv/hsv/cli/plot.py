"""The command ``hsv plot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import JsonOption, UnitsOption
from hsv.cli.output import print_written
from hsv.cli.targets import check_target, writing


def plot(
    bags: Annotated[list[Path], typer.Argument(help="Bags to plot together.")],
    out: Annotated[Path, typer.Option(help="File to write: .png, .svg or .pdf.")] = Path("flight.png"),
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Plot trajectory, attitude, elastic rates and inputs of recorded flights.

    Example: hsv plot bags/case1_20260101T000000Z --units paper --out case1.png
    """
    from hsv.bags.bag_warnings import bag_warnings
    from hsv.bags.flight import flight_data, labels
    from hsv.bags.reader import Bag
    from hsv.base.errors import QuantityError
    from hsv.pages.plots import flight_figure, save_figure

    if out.suffix not in (".png", ".svg", ".pdf"):
        raise QuantityError(f"out = {str(out)!r}: expected a file that ends in .png, .svg or .pdf")
    check_target(out, "out")
    opened = [Bag(path) for path in bags]
    named = dict(zip(labels(opened), opened, strict=True))
    flights = {name: flight_data(bag) for name, bag in named.items()}
    remarks = [f"{name}: {'; '.join(words)}" for name, bag in named.items() if (words := bag_warnings(bag))]
    with writing(out, "out"):
        save_figure(flight_figure(flights, units, remarks), out)
    print_written([out], json)
    print_bag_warnings(*opened)
