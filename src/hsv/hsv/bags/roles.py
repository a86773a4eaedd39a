"""Roles of the topics of a bag, which do not depend on namespaces and remappings."""

from __future__ import annotations

import json
from collections.abc import Mapping

from hsv.bags.description import OTHER_TOPICS, ROOT, STATE, TOPICS, resolved
from hsv.base.errors import DocumentError, RecordingError
from hsv.base.files import parse_json

NAMESPACE_KEY, REMAPPED_KEY = "namespace", "remapped"
"""Keys in the custom data of a bag: the namespace of the graph, and the names of remapped topics by role, as JSON. A
graph with default names has neither."""

TYPES = TOPICS | OTHER_TOPICS
"""Message type of the topic in each role."""
_OURS = [role for role in TYPES if role.startswith("hsv/")]


def naming(names: Mapping[str, str], namespace: str) -> dict[str, str]:
    """Return custom data with a graph's namespace and remapped ``names`` ({role: topic}); empty if all are defaults."""
    remapped = {role: name for role, name in names.items() if name != resolved(role, namespace)}
    data = {NAMESPACE_KEY: namespace} if namespace != ROOT or remapped else {}
    return data | ({REMAPPED_KEY: json.dumps(remapped)} if remapped else {})


def roles(topics: Mapping[str, str], custom_data: Mapping[str, str], source: str) -> dict[str, str]:
    """Return the names of a bag's topics by role, given their types by name; ``source`` is for error messages.

    A role has the topic that the bag's custom data name for it; if they name none, the one with the default name in the
    graph's namespace. If most step topics are found in this way, a role ``hsv/...`` without a topic gets the topic of
    its type that is left, if there is exactly one. A RecordingError refuses a topic of a wrong type in a role, and a
    bag with topics of two graphs and no recorded namespace.
    """
    remapped = _remapped(custom_data)
    found = {role: name for role, name in remapped.items() if name in topics}
    namespace = custom_data.get(NAMESPACE_KEY) or _namespace(topics, source)
    for role in TYPES:
        if role not in remapped and (name := resolved(role, namespace)) in topics and name not in found.values():
            found[role] = name
    for role, name in found.items():
        if topics[name] != TYPES[role]:
            raise RecordingError(f"{source}: topic {name} is {topics[name]}, expected {TYPES[role]}")
    # Identify remapped topics by their type alone, if most topics of the graph were found by their names.
    for role in _OURS if 2 * sum(role in found for role in TOPICS) > len(TOPICS) else ():
        alike = [name for name, kind in topics.items() if kind == TYPES[role] and name not in found.values()]
        if role not in found and len(alike) == 1:
            found[role] = alike[0]
    # In the order of the graph, not of the bag.
    return {role: found[role] for role in TYPES if role in found}


def namespace_of(names: Mapping[str, str]) -> str:
    """Return the most frequent namespace of a bag's topics, given their ``names`` by role; default: ``/``."""
    spaces = [
        name.removesuffix(f"/{role}") or ROOT
        for role, name in names.items()
        if not role.startswith("/") and name.endswith(f"/{role}")
    ]
    return max(spaces, key=spaces.count, default=ROOT)


def _remapped(custom_data: Mapping[str, str]) -> dict[str, str]:
    try:
        values = parse_json(custom_data.get(REMAPPED_KEY, "{}"))
    except DocumentError:
        return {}
    known = values.items() if isinstance(values, dict) else ()
    return {role: name for role, name in known if role in TYPES and isinstance(name, str)}


def _namespace(topics: Mapping[str, str], source: str) -> str:
    """Return the namespace of the graph from its topics; raise if topics of two graphs are mixed."""
    spaces: dict[str, set[str]] = {}
    for role in _OURS:
        for name, kind in topics.items():
            if name.endswith(f"/{role}") and (kind == TYPES[role] or name == resolved(role)):
                spaces.setdefault(name.removesuffix(f"/{role}") or ROOT, set()).add(role)
    # A graph has a plant: a single node of another graph in the same bag does not count.
    spaces = {space: there for space, there in spaces.items() if STATE in there} or spaces
    if len(spaces) > 1:
        raise RecordingError(
            f"{source}: holds the topics of {len(spaces)} graphs, in {', '.join(spaces)}: expected a bag of one, "
            "such as ros2 bag record --regex '/NAMESPACE/.*' makes"
        )
    return next(iter(spaces), ROOT)
