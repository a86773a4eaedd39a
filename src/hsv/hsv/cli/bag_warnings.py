"""Warnings on standard error about bags that are readable but incomplete."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hsv.cli.output import warn

if TYPE_CHECKING:
    from hsv.bags.reader import Bag


def print_bag_warnings(*bags: Bag) -> None:
    """Print one line per incomplete bag: damage, missing files, topics and steps, or that the bag is truncated."""
    from hsv.bags.bag_warnings import bag_warnings

    for bag in {bag.path: bag for bag in bags}.values():
        if words := bag_warnings(bag):
            warn(f"{bag.path}: {'; '.join(words)}")
