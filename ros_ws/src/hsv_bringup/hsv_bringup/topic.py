"""Print the topics of a running graph, or the messages of one topic."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from hsv.bags.columns import Track
from hsv.bags.definitions import definition, message_types
from hsv.bags.description import TOPICS, graph
from hsv.bags.export import table
from hsv.bags.units import units_of
from hsv.base.errors import ParameterError, RunError
from hsv_bringup.client import GraphClient, answer
from hsv_node.middleware import installed_class
from hsv_node.roles import node_in_role

DEPTH = 1000
"""Depth of the queue for messages that arrive while this process prints."""

_PUBLISHED = tuple(node.publishes[0] for node in graph() if node.publishes)
"""The first topic that each node of the graph publishes."""


def decoder(topic: str, kind: str) -> Callable[[bytes], dict[str, Any]]:
    """Return a function that decodes a message (bytes) to values by name and unit, such as ``altitude [m]``.

    It uses the installed definition of the message type ``kind``.
    """
    text = definition(kind)
    types = message_types([(kind, text)], topic)
    units = units_of(text, types.fielddefs, kind)

    def decode(data: bytes) -> dict[str, Any]:
        columns = table(Track(topic, kind, types, [0], [data]).columns(), units)
        return {name: column[0].item() if hasattr(column[0], "item") else column[0] for name, column in columns.items()}

    return decode


def print_topic(client: GraphClient, options: SimpleNamespace) -> None:
    """Print the messages of the topic ``options.name``, or the list of topics if it is empty."""
    (_print_messages if options.name else _print_topics)(client, options)


def _print_topics(client: GraphClient, options: SimpleNamespace) -> None:
    rows = [
        {"topic": name, "type": ", ".join(kinds)}
        | {"publishers": client.publishers_of(name), "subscribers": client.subscribers_of(name)}
        for name, kinds in _topics(client).items()
        if not topic_or_service_is_hidden(name)
    ]
    width, wide = (max(len(row[column]) for row in rows) for column in ("topic", "type"))
    for row in rows:
        links = " -> ".join(", ".join(row[end]) or "-" for end in ("publishers", "subscribers"))
        answer(f"{row['topic']:{width}}  {row['type']:{wide}}  {links}", row, options.json)


def _topics(client: GraphClient, name: str = "") -> dict[str, list[str]]:
    """Wait until all topics are known or ``name`` is published; return the types of each topic of the domain."""

    def enough() -> bool:
        return bool(name and client.count_publishers(name))

    def found() -> bool:
        return enough() or any(map(client.publishers_of, TOPICS)) or any(node_in_role(client, role) for role in graph())

    if not client.wait_for(found, "a node of the graph", _PUBLISHED):
        raise RunError(f"no node of the graph in {client.where}: expected hsv run, or nodes started by hand there")
    client.settle(enough)
    return dict(client.get_topic_names_and_types())


def _print_messages(client: GraphClient, options: SimpleNamespace) -> None:
    name = _resolved(client, options.name)
    topics = _topics(client, name)
    if not client.count_publishers(name):
        if name in topics:
            raise RunError(f"topic {name}: nobody publishes it, or nobody any more")
        published = [topic for topic in topics if client.publishers_of(topic)]
        close = difflib.get_close_matches(name, published, n=1)
        meant = f"{close[0]}?" if close else f"one of {', '.join(published)}"
        raise ParameterError(f"topic {name}: no node publishes it, expected {meant}")
    offered = client.get_publishers_info_by_topic(name)[0]
    kind = installed_class(name, offered.topic_type)
    decode = decoder(name, offered.topic_type)
    qos = QoSProfile(
        depth=DEPTH, reliability=offered.qos_profile.reliability, durability=offered.qos_profile.durability
    )
    received: list[bytes] = []
    client.create_subscription(kind, name, received.append, qos, raw=True)
    for number, data in enumerate(_messages(client, name, received)):
        if number % options.every == 0:
            fields = decode(data)
            answer("\n".join(_lines(name, fields)), fields, options.json)
            if options.once:
                return


def _resolved(client: GraphClient, name: str) -> str:
    """Return the full name of the topic ``name`` in the namespace of ``client``."""
    try:
        return str(client.resolve_topic_name(name))
    except rclpy_implementation.RCLError as error:
        # The reason is in the middle of rcl's text, before the place in its source code.
        why = str(error).partition(": ")[2].partition(", at /")[0]
        raise ParameterError(f"name = {name!r}: expected the name of a topic, such as /hsv/state ({why})") from None


def _messages(client: GraphClient, name: str, received: list[bytes]) -> Iterator[bytes]:
    """Yield the messages in ``received`` as they arrive, as long as the topic has a publisher."""
    came = False

    def known() -> bool:
        return bool(received) or not client.count_publishers(name)

    while client.wait_for(known, f"a message on {name}", for_ever=True) and received:
        came = True
        yield received.pop(0)
    if not came:
        raise RunError(f"no message on {name}, and no node that publishes it any more")


def _lines(name: str, fields: dict[str, Any]) -> Iterator[str]:
    """Yield the lines to print for a message: the topic, then name, value and unit of each field."""
    yield name
    width = max(len(field.partition(" [")[0]) for field in fields)
    for field, value in fields.items():
        label, _, unit = field.partition(" [")
        unit = unit.removesuffix("]")
        if unit == "ns":
            value, unit = f"{value * 1e-9:.9g}", "s"
        text = f"{value:.9g}" if isinstance(value, float) else str(value)
        yield f"  {label:{width}}  {text} {unit}".rstrip()
