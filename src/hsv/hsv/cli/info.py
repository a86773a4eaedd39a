"""The command ``hsv info``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hsv.base.units import UnitSystem, in_words, significant
from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import JsonOption, UnitsOption
from hsv.cli.output import console, new_table, print_json, to_json

if TYPE_CHECKING:
    from hsv.bags.reader import Bag
    from hsv.base.errors import RecordingError

SHOWN_EXCURSIONS = 5
"""Departures from the tube that are listed one by one."""


def info(
    bags: Annotated[list[Path], typer.Argument(help="Bag directories, or their .mcap files.")],
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
            console.print()
        description, problem = _described(opened, units, json)
        described.append(description)
        if problem:
            break
    if json:
        print_json(described[0] if len(bags) == 1 else {"bags": described})
    if problem:
        raise problem


def _described(opened: Bag, units: UnitSystem, json: bool) -> tuple[dict[str, Any], RecordingError | None]:
    """Return what a bag holds, and why its metrics are missing if they are; print it unless as ``json``."""
    from hsv.bags.bag_warnings import completeness
    from hsv.bags.flight import flight_data
    from hsv.bags.info import describe
    from hsv.base.errors import RecordingError
    from hsv.cli.summary import print_metrics
    from hsv.flight.metrics import METRICS, flight_metrics

    description = describe(opened)
    problem, remark = None, ""
    try:
        metrics, remark = flight_metrics(flight_data(opened)), completeness(opened)
    except RecordingError as error:
        # What else the bag holds is still worth knowing, to see what is wrong with it.
        metrics, problem = {}, error
    quantities = {name: (value, METRICS[name].unit) for name, value in metrics.items()}
    if not json:
        _print(description, units)
        if not problem:
            print_metrics(f"Metrics of an incomplete bag: {remark}" if remark else "Metrics", metrics, units)
    if not problem:
        print_bag_warnings(opened)
    measured = {"metrics_complete": not remark, "metrics": to_json(quantities, units)}
    return description | ({"metrics": None} if problem else measured), problem


def _print(description: dict[str, Any], units: UnitSystem) -> None:
    from hsv.cli.summary import print_section
    from hsv.flight.fingerprint import published_in_words

    heading = {
        "path": Path(description["path"]),
        "duration": f"{description['duration_s']:.6g} s",
        "messages": description["messages"],
        "complete": f"no: {'; '.join(description['warnings'])}" if description["warnings"] else "yes",
        "ending": description["ending"] or "not recorded",
        **description["custom_data"],
        "attached": ", ".join(f"{a['name']} ({a['size_bytes']} bytes)" for a in description["attachments"])
        or "nothing",
        "faults": _intervals(description["faults"], partial(_fault, units)),
        **_equipment(description["equipment"], units),
        "saturation": _saturation(description["saturation"]),
        "tube": _tube(description["tube"]),
        "fingerprint": published_in_words(description["fingerprint"], description["as_published"])
        + f"\n{description['fingerprint'] or ''}".rstrip(),
    }
    if description["not_covered"]:
        heading["not covered"] = "; ".join(map(str, description["not_covered"]))
    print_section("bag", heading)
    table = new_table("topic", "type", "messages", "rate Hz", right=("messages", "rate Hz"))
    for topic in description["topics"]:
        table.add_row(topic["name"], topic["type"], str(topic["messages"]), significant(topic["rate_hz"] or 0.0))
    console.print(table)


def _intervals(intervals: list[dict[str, Any]] | None, name: Callable[[dict[str, Any]], str]) -> str:
    if intervals is None:
        return "not recorded"
    return "; ".join(f"{name(i)}{_span(i)}" for i in intervals) or "none"


def _fault(units: UnitSystem, fault: dict[str, Any]) -> str:
    from hsv.bags.info import parameters_in_words

    parameters = parameters_in_words(fault, lambda value, unit: in_words(value, unit, units))
    return f"{fault['type']} {parameters}{' ' if parameters else ''}of {fault['channel']}, "


def _equipment(equipment: dict[str, Any] | None, units: UnitSystem) -> dict[str, str]:
    """Return lines on what is not ideal, none where all is."""
    from hsv.model.dynamics import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS
    from hsv.pages.report.panels import AIR_PANELS

    if equipment is None:
        return {}
    si = dict(zip((*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS), strict=True))

    def quantities(numbers: dict[str, float]) -> str:
        return ", ".join(f"{name} {in_words(value, si[name], units)}" for name, value in numbers.items())

    lines = {
        "sensors": ("rms error ", quantities(equipment["measurement_error_rms"])),
        "links": ("held ", ", ".join(f"{name} in {count} steps" for name, count in equipment["held_steps"].items())),
        "effectors": ("up to ", quantities(equipment["effector_largest_difference"])),
        "air": (
            "",
            ", ".join(
                f"{name} {' to '.join(in_words(value, AIR_PANELS[name].unit, units) for value in ends)}"
                for name, ends in equipment["air_range"].items()
            ),
        ),
    }
    ends = {"effectors": " from the commanded position"}
    return {key: f"{head}{text}{ends.get(key, '')}" for key, (head, text) in lines.items() if text}


def _span(interval: dict[str, Any]) -> str:
    end = "to the end" if interval["end_s"] is None else f"to {interval['end_s']:g} s"
    return f"from {interval['start_s']:g} s {end}"


def _saturation(saturation: dict[str, Any] | None) -> str:
    if saturation is None:
        return "not recorded"
    fuel, elevator = saturation["fuel_equivalence_ratio_steps"], saturation["elevator_deflection_steps"]
    return f"{saturation['steps']} steps (fuel equivalence ratio {fuel}, elevator deflection {elevator})"


def _tube(tube: dict[str, Any] | None) -> str:
    if tube is None:
        return "not recorded"
    if not tube["checked_steps"]:
        return "no invariant set in this design"
    text = (
        f"largest level {tube['largest_level']:.3g}, {tube['outside_steps']} of {tube['checked_steps']} steps outside"
    )
    if tube["uncertified_steps"]:
        text += ", for a vehicle that the design is not certified for"
    if tube["uncertified_hardware_steps"]:
        text += ", with hardware or air that the design is not certified for"
    excursions = tube["excursions"]
    shown = _intervals(excursions[:SHOWN_EXCURSIONS], lambda _: "")
    more = f" and {len(excursions) - SHOWN_EXCURSIONS} more" if len(excursions) > SHOWN_EXCURSIONS else ""
    return f"{text}: {shown}{more}" if excursions else text
