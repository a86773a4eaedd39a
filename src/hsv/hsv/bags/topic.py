"""Description of a topic in a bag: name, type, definition, type hash and offered quality of service."""

from __future__ import annotations

from dataclasses import dataclass

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

from hsv.base.errors import DocumentError
from hsv.base.files import parse_yaml

_INFINITE = QosTime(9223372036, 854775807)


def usual_qos(depth: int = 10, *, latched: bool = False) -> Qos:
    """Return a reliable profile; that of a ``latched`` topic keeps messages for late subscribers."""
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    limits = _INFINITE, _INFINITE, QosLiveliness.AUTOMATIC, _INFINITE, False
    return Qos(QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE, durability, *limits)


def recorded_qos(text: str, *, latched: bool) -> Qos:
    """Return the first profile in the YAML text of an MCAP channel; what it lacks or misspells is as usual."""
    usual = usual_qos(latched=latched)
    try:
        first, *_ = parse_yaml(text)
        [qos] = parse_qos([dump_qos_v9([usual])[0] | first])
    except (DocumentError, ValueError, LookupError, TypeError, AttributeError):
        return usual
    unknown = {name for name in ("history", "reliability", "durability") if getattr(qos, name).name == "UNKNOWN"}
    qos = qos._replace(**{name: getattr(usual, name) for name in unknown})
    return qos if isinstance(qos.depth, int) else usual


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
