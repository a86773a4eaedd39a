"""What a bag lacks although it could be read, said in one line beside the result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hsv.cli.output import warn

if TYPE_CHECKING:
    from hsv.recording.reader import Bag


def warn_of_shortcomings(*bags: Bag) -> None:
    """Say, a line a bag, that it is cut off, which topics of the steps it lacks, and which steps of a topic."""
    from hsv.errors import RecordingError
    from hsv.graph.description import TOPICS
    from hsv.recording.steps import irregularities

    for bag in {bag.path: bag for bag in bags}.values():
        words = []
        if not bag.complete:
            words.append(f"cut off after {bag.span[1] * 1e-9:.2f} s, hsv recover mends it")
        if missing := [topic for topic in TOPICS if topic not in bag.topics]:
            words.append(f"no topic {', '.join(missing)}")
        try:
            words += irregularities(bag)
        except RecordingError as error:
            words.append(str(error).removeprefix(f"{bag.path}: "))
        if words:
            warn(f"{bag.path}: {'; '.join(words)}")
