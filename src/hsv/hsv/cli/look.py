"""Commands that look at recorded flights: report, plots, contents."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from hsv.base.units import UnitSystem, quantity_text, significant
from hsv.cli import output
from hsv.cli.options import (
    JsonOption,
    SuppliedDesignOption,
    SuppliedScenarioOption,
    UnitsOption,
    check_target,
    writing,
)

if TYPE_CHECKING:
    from hsv.bags.reader import Bag
    from hsv.base.errors import RecordingError

SHOWN_EXCURSIONS = 5
"""Maximum number of excursions from the tube that are listed one by one."""


def report(
    bags: Annotated[list[Path], Argument(help="Bags to report on; several are compared in the same plots.")],
    out: Annotated[Path, Option(help="HTML file to write.")] = Path("report.html"),
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
    from hsv.pages.report import write_report

    check_target(out, "out", ".html", ".htm")
    opened = [Bag(bag) for bag in bags]
    if design or scenario:
        from hsv.bags.replay.attached import supply

        for bag in opened:
            supply(bag, design, scenario)
    write_report(opened, out, units=units)
    output.print_written([out], json)
    output.print_bag_warnings(*opened)


def plot(
    bags: Annotated[list[Path], Argument(help="Bags, or result files of campaigns, to plot together.")],
    out: Annotated[Path, Option(help="File to write: .png, .svg or .pdf.")] = Path("flight.png"),
    panels: Annotated[str, Option(help="What to plot, such as altitude,elevator, or survival.")] = "",
    start: Annotated[str, Option("--from", help="First time to plot, with unit.")] = "",
    end: Annotated[str, Option("--to", help="Last time to plot, with unit.")] = "",
    size: Annotated[str, Option(help="Width and height for print, such as 85x60mm.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Plot trajectory, attitude, elastic rates and inputs of recorded flights, or the panels of your choice.

    The panels of a campaign (.parquet): survival, the envelope of a signal such as altitude_error, a metric, and
    METRIC over FACTOR as a scatter plot.

    Example: hsv plot bags/case1_20260101T000000Z --panels altitude,elevator --size 85x60mm --out case1.pdf
    """
    from hsv.bags.flight import flight_data, labels
    from hsv.bags.reader import Bag
    from hsv.bags.steps import bag_warnings
    from hsv.pages.plots import Layout, flight_figure, save_figure

    check_target(out, "out", ".png", ".svg", ".pdf")
    chosen = panels.split(",") if panels else ()
    if all(path.suffix == ".parquet" for path in bags):
        from hsv.flight.campaign.summary import Results
        from hsv.pages.campaign_plots import campaign_figure

        campaigns = {path.stem: Results(path) for path in bags}
        with writing(out, "out"):
            save_figure(campaign_figure(campaigns, units, chosen, Layout.of((), start, end, size)), out)
        output.print_written([out], json)
        return
    layout = Layout.of(chosen, start, end, size)
    opened = [Bag(path) for path in bags]
    named = dict(zip(labels(opened), opened, strict=True))
    flights = {name: flight_data(bag) for name, bag in named.items()}
    remarks = [f"{name}: {'; '.join(words)}" for name, bag in named.items() if (words := bag_warnings(bag))]
    with writing(out, "out"):
        save_figure(flight_figure(flights, units, remarks, layout), out)
    output.print_written([out], json)
    output.print_bag_warnings(*opened)


def info(
    bags: Annotated[list[Path], Argument(help="Bag directories, or their .mcap files.")],
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Show the contents of bags: duration, topics, scenario, design, faults, metrics.

    With --json, several bags are printed as a list.

    Example: hsv info bags/case1_20260101T000000Z
    """
    from hsv.bags.reader import Bag

    described = []
    for number, opened in enumerate([Bag(bag) for bag in bags]):
        if number and not json:
            output.console.print()
        description, problem = _described(opened, units, json)
        described.append(description)
        if problem:
            break
    if json:
        output.print_json(described[0] if len(bags) == 1 else {"bags": described})
    if problem:
        raise problem


def _described(opened: Bag, units: UnitSystem, json: bool) -> tuple[dict[str, Any], RecordingError | None]:
    """Return the contents of a bag, and the error if it is damaged, or None; without ``json``, print the contents."""
    from hsv.bags.flight import MEASURED, flight_data
    from hsv.bags.info import attached_scenario, describe
    from hsv.bags.steps import completeness
    from hsv.base.errors import RecordingError
    from hsv.cli.summary import print_metrics
    from hsv.flight.limits import limits_kept, verdicts
    from hsv.flight.metrics import metric_of

    description = describe(opened)
    problem, remark = None, ""
    lacking = [opened.name_of(topic) for topic in MEASURED if topic not in opened.roles]
    metrics: dict[str, float] = {}
    missing: dict[str, str] = {}
    try:
        if not lacking:
            flown = flight_data(opened)
            metrics, missing, remark = flown.metrics, flown.missing, completeness(opened)
            metrics = metrics | {row["metric"]: row["margin"] for row in description["requirements"] or ()}
    except RecordingError as error:
        # The other contents help to see what is wrong with the bag.
        problem = error
    quantities = {name: (value, metric_of(name).unit) for name, value in metrics.items()}
    scenario = None if problem or lacking else attached_scenario(opened)
    judged = verdicts(scenario, metrics, missing, ended=description["ending"] == "finished") if scenario else {}
    if not json:
        _print_description(description, units)
        if lacking:
            output.say(f"no metrics: they need {', '.join(lacking)}")
        elif not problem:
            title = f"Metrics of an incomplete bag: {remark}" if remark else "Metrics"
            print_metrics(title, metrics, missing, units, judged)
        if scenario:
            output.say(output.folded(f"verdict {limits_kept(judged, units)}"))
    if not problem:
        output.print_bag_warnings(opened)
    within = all(verdict.kept for verdict in judged.values()) if judged else None
    measured = {"metrics_complete": not remark, "metrics": output.to_json(quantities, units), "within_limits": within}
    return description | ({"metrics": None} if problem or lacking else measured), problem


def _print_description(description: dict[str, Any], units: UnitSystem) -> None:
    from hsv.flight.fingerprint import published_in_words
    from hsv.flight.flight import step_times_in_words

    attached = ", ".join(f"{a['name']} ({a['size_bytes']} bytes)" for a in description["attachments"])
    published = published_in_words(description["fingerprint"], description["as_published"])
    heading = {
        "path": Path(description["path"]),
        "duration": f"{description['duration_s']:.6g} s",
        "messages": description["messages"],
        "complete": f"no: {'; '.join(description['warnings'])}" if description["warnings"] else "yes",
        "ended": {"broken off": "interrupted"}.get(ending := description["ending"], ending or "not recorded"),
        **description["custom_data"],
        "attached": attached or "nothing",
        "faults": _intervals(description["faults"], partial(_fault, units)),
        **_equipment(description["equipment"], units),
        "control law": step_times_in_words(times) if (times := description["step_times"]) else "not recorded",
        "saturation": _numbers(description["saturation"]),
        "tube": _tube(description["tube"]),
        "fingerprint": f"{published}\n{description['fingerprint'] or ''}".rstrip(),
    }
    if description["not_covered"]:
        heading["not covered"] = "; ".join(map(str, description["not_covered"]))
    if description["disk_margin"]:
        heading["limits"] = description["disk_margin"]["words"]
    output.print_section("bag", heading)
    if required := description["requirements"]:
        table = output.new_table("id", "requirement", "margin", "verdict", "fingerprint", right=["margin"])
        for row in required:
            decided = "" if row["decided_at_s"] is None else f", decided at {row['decided_at_s']:g} s"
            verdict = f"{'kept' if row['kept'] else 'broken'}{decided}"
            shown = (description["fingerprint"] or "")[:15]
            table.add_row(row["id"], f"{row['name']}: {row['requirement']}", significant(row["margin"]), verdict, shown)
        output.console.print(table)
    table = output.new_table("topic", "type", "messages", "rate Hz", right=("messages", "rate Hz"))
    for topic in description["topics"]:
        table.add_row(topic["name"], topic["type"], str(topic["messages"]), significant(topic["rate_hz"] or 0.0))
    output.console.print(table)


def _intervals(intervals: list[dict[str, Any]] | None, name: Callable[[dict[str, Any]], str]) -> str:
    if intervals is None:
        return "not recorded"
    ends = ("to the end" if i["end_s"] is None else f"to {i['end_s']:g} s" for i in intervals)
    found = zip(intervals, ends, strict=True)
    return "; ".join(f"{name(i)}from {i['start_s']:g} s {end}" for i, end in found) or "none"


def _fault(units: UnitSystem, fault: dict[str, Any]) -> str:
    from hsv.bags.info import parameters_in_words

    parameters = parameters_in_words(fault, lambda value, unit: quantity_text(value, unit, units))
    return f"{fault['type']} {parameters}{' ' if parameters else ''}of {fault['channel']}, "


def _equipment(equipment: dict[str, Any] | None, units: UnitSystem) -> dict[str, str]:
    """Return the texts of hsv info on sensors, repeated (held) steps, effectors and air; ideal ones have none."""
    from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS
    from hsv.pages.panels import AIR_PANELS

    si = dict(zip((*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS), strict=True))
    si |= {name: panel.unit for name, panel in AIR_PANELS.items()}

    def line(key: str, form: str) -> str:
        numbers = (equipment or {}).get(key, {}).items()
        ends = ((name, value if isinstance(value, list) else [value]) for name, value in numbers)
        words = (
            f"{name} {' to '.join(quantity_text(v, si.get(name, '1'), units) for v in given)}" for name, given in ends
        )
        return form.format(text) if (text := ", ".join(words)) else ""

    lines = {
        "sensors": line("measurement_error_rms", "rms error {}"),
        "held steps": line("held_steps", "{}"),
        "effectors": line("effector_largest_difference", "up to {} from the commanded position"),
        "air": line("air_range", "{}"),
    }
    return {key: text for key, text in lines.items() if text}


def _numbers(values: dict[str, Any] | None) -> str:
    """Return as text the numbers in ``values`` with their keys; zeros are left out, except for the first number."""
    if values is None:
        return "not recorded"
    numbers = [(key.replace("_", " "), v) for key, v in values.items() if isinstance(v, int | float)]
    shown = [numbers[0], *(pair for pair in numbers[1:] if pair[1])]
    return ", ".join(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in shown)


def _tube(tube: dict[str, Any] | None) -> str:
    if tube and not tube["checked_steps"]:
        return "no invariant set in this design"
    if not tube or not tube["excursions"]:
        return _numbers(tube)
    excursions = tube["excursions"]
    more = f" and {len(excursions) - SHOWN_EXCURSIONS} more" if len(excursions) > SHOWN_EXCURSIONS else ""
    return f"{_numbers(tube)}; outside: {_intervals(excursions[:SHOWN_EXCURSIONS], lambda _: '')}{more}"
