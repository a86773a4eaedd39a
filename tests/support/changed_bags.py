"""Copies of bags in which something is changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from hsv.bags.reader import Bag
from hsv.bags.topic import Topic
from hsv.bags.writer import BagWriter

Messages = list[tuple[int, bytes]]
"""Times in nanoseconds, and CDR."""

NO_ATTACHMENTS: Mapping[str, bytes] = {}
NO_CUSTOM_DATA: Mapping[str, str] = {}


def changed_bag(
    source: Path,
    target: Path,
    topics: Callable[[Topic], Topic | None] = lambda topic: topic,
    messages: Callable[[str, Messages], Messages] = lambda topic, messages: messages,
    attachments: Mapping[str, bytes] = NO_ATTACHMENTS,
    custom_data: Mapping[str, str] = NO_CUSTOM_DATA,
) -> Path:
    """Write ``source`` again to ``target`` with other topics (None: left out), messages, attachments or custom data."""
    bag = Bag(source)
    changed = [(name, topics(topic)) for name, topic in bag.topics.items()]
    kept = {name: topic for name, topic in changed if topic}
    writer = BagWriter(target, list(kept.values()), bag.custom_data | dict(custom_data))
    for name, data in (bag.attachments | dict(attachments)).items():
        writer.attach(name, bag.media_types.get(name, "text/plain"), data)
    for name, topic in kept.items():
        for time, data in messages(name, bag.messages(name)):
            writer.write(topic.name, time, data)
    writer.close()
    return target
