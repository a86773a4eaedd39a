"""Description of a topic in a bag: name, type, definition, type hash and offered quality of service."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import yaml

from hsv.base.errors import DocumentError
from hsv.base.files import parse_yaml

INFINITE = 2**63 - 1
"""Infinite duration, ns; ROS 2 writes sec 9223372036, nsec 854775807."""


def _duration(nanoseconds: int) -> dict[str, int]:
    sec, nsec = divmod(nanoseconds, 10**9)
    return {"sec": sec, "nsec": nsec}


@dataclass(frozen=True, slots=True)
class Qos:
    """A quality-of-service profile with the terms of rosbag2; durations in nanoseconds."""

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    """``transient_local`` for latched topics, which a player must offer with the same durability."""
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = "automatic"
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the nine keys of a profile in rosbag2."""
        return {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": _duration(self.deadline),
            "lifespan": _duration(self.lifespan),
            "liveliness": self.liveliness,
            "liveliness_lease_duration": _duration(self.liveliness_lease_duration),
            "avoid_ros_namespace_conventions": self.avoid_ros_namespace_conventions,
        }

    @classmethod
    @cache
    def from_yaml(cls, text: str, usual: Qos) -> Qos:
        """Return the first profile in a text as from :meth:`as_yaml`; unusable entries are those of ``usual``."""
        try:
            profiles = parse_yaml(text)
        except DocumentError:
            return usual
        given = profiles[0] if isinstance(profiles, list) and profiles else {}
        if not isinstance(given, dict):
            return usual
        return cls(**{key: _usable(key, given.get(key), default) for key, default in asdict(usual).items()})

    def as_yaml(self) -> str:
        """Return the profile as the YAML list in the metadata of an MCAP channel."""
        return yaml.safe_dump([self.as_dict()], sort_keys=False)


_WORDS = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available"),
}
"""The words of rosbag2; Humble and Iron write their numbers, the positions here, as rmw counts them."""


def _usable(key: str, value: Any, default: Any) -> Any:
    """Return an entry of a profile, a duration in nanoseconds, or ``default`` if it has no valid value."""
    if words := _WORDS.get(key):
        if type(value) is int and 0 <= value < len(words):
            return words[value]
        return value if value in words else default
    if isinstance(value, dict) and all(isinstance(value.get(part), int) for part in ("sec", "nsec")):
        value = value["sec"] * 10**9 + value["nsec"]
    return value if type(value) is type(default) else default


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of a bag."""

    name: str
    type: str
    """``package/msg/Type``."""
    definition: str
    """Message definition with its dependencies; see :func:`hsv.bags.definitions.definition`."""
    type_hash: str
    """``RIHS01_`` and 64 hexadecimal digits; empty if unknown."""
    qos: Qos
    count: int = 0
    """Number of recorded messages."""
    schema_encoding: str = "ros2msg"
    encoding: str = "cdr"
