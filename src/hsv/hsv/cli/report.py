"""The command ``hsv report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import JsonOption, SuppliedDesignOption, SuppliedScenarioOption, UnitsOption
from hsv.cli.output import print_written
from hsv.cli.targets import check_target


def report(
    bags: Annotated[list[Path], typer.Argument(help="Bags to report on; several are compared in the same plots.")],
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("report.html"),
    design: SuppliedDesignOption = None,
    scenario: SuppliedScenarioOption = None,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Write a report on recorded flights: verdict, metrics, linked plots, events, parameters, how to repeat them.

    The report is a single file that works offline; its units can be switched.

    Example: hsv report bags/case1_20260101T000000Z bags/case1_no_notch_20260101T000000Z --out comparison.html
    """
    from hsv.bags.reader import Bag
    from hsv.base.errors import QuantityError
    from hsv.pages.report.page import write_report

    if out.suffix not in (".html", ".htm"):
        raise QuantityError(f"out = {str(out)!r}: expected a file that ends in .html")
    check_target(out, "out")
    opened = [Bag(bag) for bag in bags]
    if design or scenario:
        from hsv.bags.replay.attached import supply

        for bag in opened:
            supply(bag, design, scenario)
    write_report(opened, out, units=units)
    print_written([out], json)
    print_bag_warnings(*opened)
