"""What a bag lacks although it could be read, said in one line beside the result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hsv.cli.output import warn

if TYPE_CHECKING:
    from hsv.recording.reader import Bag


def warn_of_shortcomings(*bags: Bag) -> None:
    """Say what each bag lacks, a line a bag: damage, missing files, topics and steps, that it is cut off."""
    from hsv.recording.shortcomings import shortcomings

    for bag in {bag.path: bag for bag in bags}.values():
        if words := shortcomings(bag):
            warn(f"{bag.path}: {'; '.join(words)}")
