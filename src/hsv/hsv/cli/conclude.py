"""The command ``hsv conclude``: what ``hsv run`` does when the nodes have ended, for other launchers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.options import BagArgument, JsonOption, ReportOption, UnitsOption


def conclude(
    bag: BagArgument,
    report: ReportOption = True,
    failure: Annotated[str, typer.Option(help="Error message of a process that failed; it becomes the verdict.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Conclude a flight whose nodes have exited: close its bag, print summary and verdict, and write the report.

    Launch files call this after the nodes, and hsv prepare before them; hsv run does both by itself.

    Example: hsv conclude bags/case1_20260101T000000Z
    """
    from hsv.graph.flight import close_bag

    close_bag(bag, [failure] if failure else [])
    conclude_flight(bag, report=report, units=units, json=json, wall_time=None)


def conclude_flight(bag: Path, *, report: bool, units: UnitSystem, json: bool, wall_time: float | None) -> None:
    """Print the summary of the flight in ``bag`` and write its report into the bag's folder.

    Args:
        bag: The bag directory, closed.
        report: Whether to write the report.
        units: Units of what is printed.
        json: Whether to print JSON.
        wall_time: Wall time (s) that the flight took, where it is known.

    Raises:
        RecordingError: The bag holds no flight with its scenario, or the report cannot be written.
        RunError: The flight diverged or was broken off; the summary is printed before.
    """
    from hsv.bags.flight import flight_data
    from hsv.bags.info import describe
    from hsv.bags.reader import Bag
    from hsv.base.errors import RecordingError
    from hsv.cli.summary import report_flight
    from hsv.flight.metrics import flight_metrics
    from hsv.flight.scenario import parse_scenario
    from hsv.pages.report.page import write_report

    recorded = Bag(bag)
    if "scenario.toml" not in recorded.attachments:
        raise RecordingError(
            f"{bag}: has no scenario, like every bag of a graph started by hand: use hsv info and hsv report"
        )
    data = flight_data(recorded)
    files = {"bag": bag}
    unwritten = None
    if report:
        page = bag / "report.html"
        try:
            write_report([recorded], page, units=units)
            files["report"] = page
        except RecordingError as error:
            unwritten = error  # the flight itself is whole, and told first
    description = describe(recorded)
    report_flight(
        parse_scenario(recorded.text("scenario.toml"), recorded.custom_data.get("scenario", "")),
        flight_metrics(data),
        fingerprint=description["fingerprint"],
        design_hash=recorded.custom_data.get("design_hash", ""),
        ending=description["ending"],
        wall_time=wall_time,
        simulated_time=float(data.time[-1]),
        units=units,
        json=json,
        not_covered=description["not_covered"],
        files=files,
    )
    if unwritten:
        raise unwritten
