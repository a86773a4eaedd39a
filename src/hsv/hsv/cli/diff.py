"""The command ``hsv diff``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from hsv.base.units import significant
from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import BagArgument, JsonOption
from hsv.cli.output import console, folded, new_table, print_json

if TYPE_CHECKING:
    from hsv.bags.compare import Comparison, Difference


def diff(
    first: BagArgument,
    second: BagArgument,
    tolerance: Annotated[float, typer.Option(help="Absolute and relative tolerance; 0: compare every bit.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Compare two bags step by step: print the first difference, and the largest difference of every field.

    The exit code is 0 if all step topics are equal, and 1 if not, or if a topic is missing in one of the bags.

    Example: hsv diff bags/case1_20260101T000000Z bags/case1_20260102T000000Z
    """
    from hsv.bags.compare import compare
    from hsv.bags.description import TOPICS
    from hsv.bags.reader import Bag
    from hsv.base.errors import ParameterError, RecordingError

    if not 0.0 <= tolerance < math.inf:
        raise ParameterError(f"tolerance = {tolerance}: expected a finite number, not below zero")
    bags = Bag(first), Bag(second)
    # What both lack is no difference.
    topics = [topic for topic in TOPICS if all(topic in bag.roles for bag in bags)]
    alone = {topic: bag for bag in bags for topic in TOPICS if topic in bag.roles and topic not in topics}
    if not topics:
        raise RecordingError(f"{bags[1].path}: no step topic that {bags[0].path} has, too")
    compared = [compare(bags[0].track(topic), bags[1].track(topic), tolerance=tolerance) for topic in topics]
    differences = [c.first for c in compared if c.first]
    earliest = min(differences, key=lambda d: d.time_ns, default=None)
    if json:
        print_json(
            {
                "equal": earliest is None and not alone,
                "identical": all(c.identical for c in compared) and not alone,
                "in_one_only": {bag.name_of(topic): str(bag.path) for topic, bag in alone.items()},
                "first_difference": earliest
                and {
                    "topic": earliest.topic,
                    "step": earliest.step,
                    "time_s": earliest.time_ns * 1e-9,
                    "field": earliest.field,
                    "first": earliest.expected,
                    "second": earliest.actual,
                },
                "largest_difference": {c.topic: c.largest for c in compared if c.largest},
                "messages": {c.topic: [c.expected_count, c.actual_count] for c in compared},
                "messages_of_the_same_step": {c.topic: c.common_count for c in compared},
            }
        )
    else:
        for topic, bag in alone.items():
            console.print(f"{bag.name_of(topic)} is in {bag.path} only", soft_wrap=True)
        _print(compared, earliest)
    print_bag_warnings(*bags)
    raise typer.Exit(1 if earliest or alone else 0)


def _print(compared: list[Comparison], earliest: Difference | None) -> None:
    if earliest is None:
        count = sum(c.actual_count for c in compared)
        padding = sum(c.different_padding for c in compared)
        identical = f"identical{f' in every byte except the padding of {padding}' if padding else ''}"
        same = identical if all(c.identical for c in compared) else "equal within the tolerance"
        console.print(f"{count} messages: {same}", soft_wrap=True)
    else:
        console.print(folded(f"first difference at t = {earliest.time_ns * 1e-9:.2f} s: {earliest}"), soft_wrap=True)
        common = sum(c.common_count for c in compared)
        if common < max(sum(c.expected_count for c in compared), sum(c.actual_count for c in compared)):
            equal = not any(c.largest for c in compared)
            same = f"{common} messages of the same steps are compared"
            console.print(f"{same}{', and they are equal' if equal else ''}", soft_wrap=True)
    table = new_table("topic", "field", "largest difference", right=["largest difference"])
    for comparison in compared:
        for name, value in comparison.largest.items():
            table.add_row(comparison.topic, name, "no number" if math.isnan(value) else significant(value))
    if table.row_count:
        console.print(table)
