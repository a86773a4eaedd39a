"""Description of a topic in a bag: name, type, definition, type hash and offered quality of service."""

from __future__ import annotations

from dataclasses import dataclass
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
    def from_yaml(cls, text: str, usual: Qos) -> Qos:
        """Return the first profile in a text as from :meth:`as_yaml`; missing entries are those of ``usual``."""
        given = (_readable_profiles(text, usual) or [usual.as_dict()])[0]
        for key, value in given.items():
            if isinstance(value, dict):
                given[key] = int(value["sec"]) * 10**9 + int(value["nsec"])
        return cls(**given)

    def as_yaml(self) -> str:
        """Return the profile as the YAML list in the metadata of an MCAP channel."""
        return yaml.safe_dump([self.as_dict()], sort_keys=False)


def _readable_profiles(text: str, usual: Qos) -> list[dict[str, Any]]:
    """Return the profiles in the metadata of a channel, with those of ``usual`` for damaged entries."""
    try:
        profiles = parse_yaml(text)
    except DocumentError:
        return []
    if not isinstance(profiles, list) or not all(isinstance(profile, dict) for profile in profiles):
        return []
    return [
        {key: _sound(key, profile.get(key), value) for key, value in usual.as_dict().items()} for profile in profiles
    ]


def repaired_profiles(text: str) -> str:
    """Return the ``text`` of profiles, repaired if it is damaged; empty if it cannot be repaired."""
    profiles = _readable_profiles(text, Qos())
    if not profiles:
        return ""
    return text if profiles == parse_yaml(text) else yaml.safe_dump(profiles, sort_keys=False)


_WORDS = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available"),
}
"""The words of rosbag2; Humble and Iron write their numbers, the positions here, as rmw counts them."""


def _sound(key: str, value: Any, default: Any) -> Any:
    if isinstance(default, dict):
        times = value if isinstance(value, dict) else {}
        return value if all(isinstance(times.get(part), int) for part in default) else default
    words = _WORDS.get(key, (value,))
    if type(value) is int and key in _WORDS and 0 <= value < len(words):
        return words[value]
    return value if isinstance(value, type(default)) and value in words else default


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
