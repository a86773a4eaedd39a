"""Changed copies of bags."""

from types import MappingProxyType

from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter

Messages = list[tuple[int, bytes]]
"""Messages of a topic: time (ns) and CDR bytes."""


def changed_bag(
    source,
    target,
    topics=lambda topic: topic,
    messages=lambda topic, messages: messages,
    attachments=MappingProxyType({}),
    custom_data=MappingProxyType({}),
):
    """Copy ``source`` to ``target`` with changed topics, messages, attachments (None: no attachments) or data."""
    bag = Bag(source)
    changed = [(name, topics(topic)) for name, topic in bag.topics.items()]
    kept = {name: topic for name, topic in changed if topic}
    writer = BagWriter(target, list(kept.values()), bag.custom_data | dict(custom_data))
    for name, data in ({} if attachments is None else bag.attachments | dict(attachments)).items():
        writer.attach(name, bag.media_types.get(name, "text/plain"), data)
    for name, topic in kept.items():
        for time, data in messages(name, bag.messages(name)):
            writer.write(topic.name, time, data)
    writer.close()
    return target
