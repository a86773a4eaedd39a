"""Roles of the graph: a node is identified by the types of its messages, because names may be remapped."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain

from rclpy.node import Node, NodeNameNonExistentError

from hsv.bags.description import NodeDescription
from hsv_node.middleware import type_name


def node_in_role(asking: Node, role: NodeDescription) -> tuple[str, str] | None:
    """Return name and namespace of the node that has ``role`` in the graph of node ``asking``, or None.

    The node is in the namespace of ``asking``, or publishes a topic of its role there from another namespace.
    """
    here = (node for node in asking.get_node_names_and_namespaces() if node[1] == asking.get_namespace())
    publishers = (
        (endpoint.node_name, endpoint.node_namespace)
        for topic in role.own_topics
        for endpoint in asking.get_publishers_info_by_topic(topic)
    )
    return next((node for node in chain(here, publishers) if role.known_by in published_types(asking, *node)), None)


def full_name(name: str, namespace: str) -> str:
    """Return the full name of a node, such as ``/veh1/plant``; a placeholder if its namespace is not known yet."""
    if not namespace.startswith("/"):
        return "a node that just joins"
    return f"{namespace.rstrip('/')}/{name}"


def published_types(asking: Node, name: str, namespace: str) -> set[str]:
    """Return the names of all message types that a node publishes, as far as node ``asking`` knows."""
    found = _known(asking.get_publisher_names_and_types_by_node, name, namespace)
    return {kind for kinds in found.values() for kind in kinds}


def name_of(asking: Node, role: NodeDescription, kind: type) -> str | None:
    """Return the full name of the topic or service of type ``kind`` that the node in ``role`` offers, or None."""
    node = node_in_role(asking, role)
    if node is None:
        return None
    offered = _known(asking.get_publisher_names_and_types_by_node, *node)
    offered |= _known(asking.get_service_names_and_types_by_node, *node)
    return next((name for name, kinds in offered.items() if type_name(kind) in kinds), None)


def _known(look: Callable[[str, str], list[tuple[str, list[str]]]], name: str, namespace: str) -> dict[str, list[str]]:
    if not namespace.startswith("/"):
        return {}  # an endpoint whose node is not known yet
    try:
        return dict(look(name, namespace))
    except NodeNameNonExistentError:
        return {}  # the node has just left
