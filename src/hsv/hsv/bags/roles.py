"""Roles of the topics of a bag: namespaces and remappings change the names, not the roles."""

from __future__ import annotations

import json
from collections.abc import Mapping

from hsv.bags.description import OTHER_TOPICS, ROOT, STATE, TOPICS, resolved
from hsv.base.errors import DocumentError, RecordingError
from hsv.base.files import parse_json

NAMESPACE_KEY, REMAPPED_KEY = "namespace", "remapped"
"""Under which a bag says it in its custom data: the namespace of the graph and, as JSON, by role, the names of topics
that have not their usual ones there. A graph that was not moved has neither."""

TYPES = TOPICS | OTHER_TOPICS
"""Type of the topic of each role."""
_OURS = [role for role in TYPES if role.startswith("hsv/")]


def naming(names: Mapping[str, str], namespace: str) -> dict[str, str]:
    """Return the custom data that tell of the topics' ``names`` by role in a graph that flies in ``namespace``."""
    others = {role: name for role, name in names.items() if name != resolved(role, namespace)}
    said = {NAMESPACE_KEY: namespace} if namespace != ROOT or others else {}
    return said | ({REMAPPED_KEY: json.dumps(others)} if others else {})


def roles(topics: Mapping[str, str], custom_data: Mapping[str, str], source: str) -> dict[str, str]:
    """Return the names of a bag's topics by role.

    Where the bag does not say it, a topic is known by the end of its name and its type, and where that is no help
    because it was remapped, by its type alone, if no other has it.

    Args:
        topics: Types of the topics, ``package/msg/Type``, by name.
        custom_data: Custom data of the bag.
        source: Path of the bag, for error messages.

    Raises:
        RecordingError: A topic has not the type of its role, or there are topics of two graphs.
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
    # A remapped topic is known by its type alone, if most of the graph's topics were found by their names.
    for role in _OURS if 2 * sum(role in found for role in TOPICS) > len(TOPICS) else ():
        alike = [name for name, kind in topics.items() if kind == TYPES[role] and name not in found.values()]
        if role not in found and len(alike) == 1:
            found[role] = alike[0]
    # In the order of the graph, whatever the order in the bag.
    return {role: found[role] for role in TYPES if role in found}


def namespace_of(names: Mapping[str, str]) -> str:
    """Return the namespace of the graph whose topics have these ``names`` by role: that of most of them."""
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
    """Return the namespace in which the topics of a graph are, by the ends of their names.

    Raises:
        RecordingError: There are topics of two graphs.
    """
    spaces: dict[str, set[str]] = {}
    for role in _OURS:
        for name, kind in topics.items():
            if name.endswith(f"/{role}") and (kind == TYPES[role] or name == resolved(role)):
                spaces.setdefault(name.removesuffix(f"/{role}") or ROOT, set()).add(role)
    # A graph has a plant; a single node of another one, recorded with it, is no second graph.
    spaces = {space: there for space, there in spaces.items() if STATE in there} or spaces
    if len(spaces) > 1:
        raise RecordingError(
            f"{source}: holds the topics of {len(spaces)} graphs, in {', '.join(spaces)}: expected a bag of one, "
            "such as ros2 bag record --regex '/NAMESPACE/.*' makes"
        )
    return next(iter(spaces), ROOT)
