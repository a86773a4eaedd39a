"""Which steps the topics of a bag hold, and rows of the same step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hsv.errors import RecordingError
from hsv.graph.description import TOPICS
from hsv.recording.columns import Columns
from hsv.recording.reader import Bag
from hsv.recording.recover import RECOVERED


def cut_off(bag: Bag) -> bool:
    """Whether what was recorded last may be missing: the recorder was killed, even if the bag was mended since."""
    return not bag.complete or RECOVERED.items() <= bag.custom_data.items()


def joined(bag: Bag, topics: Sequence[str]) -> dict[str, Columns]:
    """Return the columns of ``topics`` row by row of the same step: the steps that all of them have, in order.

    Raises:
        RecordingError: A topic is missing or carries no step, or there is no step that all have.
    """
    columns = {topic: bag.columns(topic) for topic in topics}
    steps = [found["step"] for found in columns.values()]
    common = steps[0]
    for found in steps:
        common = np.intersect1d(common, found)
    if not len(common):
        raise RecordingError(f"{bag.path}: holds no complete step, expected a flight")
    if all(np.array_equal(found, common) for found in steps):
        return columns
    rows = {}
    for topic, found in zip(topics, steps, strict=True):
        present, first = np.unique(found, return_index=True)
        rows[topic] = columns[topic].rows(first[np.searchsorted(present, common)])
    return rows


def irregularities(bag: Bag) -> list[str]:
    """Say which step topics lack steps that others have, or have theirs twice or out of order; nothing of a whole bag.

    Of a bag that is cut off, the steps count that all topics have reached.

    Raises:
        RecordingError: A message does not fit its definition.
    """
    stamps: dict[str, NDArray[np.int64]] = {}
    for topic in TOPICS:
        if topic in bag.topics:
            columns = bag.columns(topic)
            if name := next((name for name in ("clock", "header.stamp") if name in columns), None):
                stamps[topic] = columns[name]
    every = np.unique(np.concatenate([np.array([], np.int64), *stamps.values()]))
    if cut_off(bag):
        every = every[every <= min((stamp.max(initial=-1) for stamp in stamps.values()), default=-1)]
    words = []
    for topic, stamp in stamps.items():
        if len(missing := np.setdiff1d(every, stamp)):
            first = f"the first at t = {missing[0] * 1e-9:.2f} s"
            words.append(f"{topic} lacks {len(missing)} of {len(every)} steps, {first}")
        if len(late := stamp[1:][stamp[1:] <= stamp[:-1]]):
            words.append(f"{topic} is out of order at t = {late[0] * 1e-9:.2f} s")
    return words
