"""Topics and metadata of a bag in the format of rosbag2 (version 9): metadata.yaml, and its copy in the MCAP file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

from hsv.base.errors import DocumentError
from hsv.base.files import parse_yaml, read_text

CUSTOM_DATA = "custom_data"
"""Name of the MCAP metadata records that hold the custom data; later records add to earlier ones."""
ROSBAG2 = "rosbag2"
"""Name of the MCAP metadata record in which rosbag2 keeps a copy of metadata.yaml."""
SERIALIZED = "serialized_metadata"
"""Key, in the MCAP metadata record of rosbag2, of the text of metadata.yaml without its root key."""
FILE_NAME = "metadata.yaml"
ROOT = "rosbag2_bagfile_information"
VERSION = 9
DISTRO = "jazzy"
EMPTY_SPAN = 2**63 - 1, 0
"""First and last time (ns) that rosbag2 states for a bag without messages."""
_INFINITE = QosTime(9223372036, 854775807)


class _Quoted(str):
    """Text in double quotes, so that YAML reads neither an empty text as null nor a commit such as 12e5 as a number."""

    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    pass


_Dumper.add_representer(
    _Quoted, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"')
)


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


def usual_qos(depth: int = 10, *, latched: bool = False) -> Qos:
    """Return a reliable quality of service; if ``latched``, late subscribers receive the last ``depth`` messages."""
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    limits = _INFINITE, _INFINITE, QosLiveliness.AUTOMATIC, _INFINITE, False
    return Qos(QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE, durability, *limits)


def recorded_qos(text: str, *, latched: bool) -> Qos:
    """Return an MCAP channel's first quality of service (YAML); usual values replace missing ones, all if invalid."""
    usual = usual_qos(latched=latched)
    try:
        first, *_ = parse_yaml(text)
        [qos] = parse_qos([dump_qos_v9([usual])[0] | first])
    except (DocumentError, ValueError, LookupError, TypeError, AttributeError):
        return usual
    unknown = {name for name in ("history", "reliability", "durability") if getattr(qos, name).name == "UNKNOWN"}
    qos = qos._replace(**{name: getattr(usual, name) for name in unknown})
    return qos if isinstance(qos.depth, int) else usual


def information(
    file: str, topics: Sequence[Topic], span: tuple[int, int], custom: Mapping[str, str], distro: str = DISTRO
) -> dict[str, Any]:
    """Return the metadata of a bag with one file, with all keys that rosbag2 requires.

    ``span`` is the time of the first and of the last message, ns, or EMPTY_SPAN if there are no messages.
    """
    start, duration = {"nanoseconds_since_epoch": span[0]}, {"nanoseconds": max(span[1] - span[0], 0)}
    count = sum(topic.count for topic in topics)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": dict(duration),
        "starting_time": dict(start),
        "message_count": count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": topic.encoding,
                    "offered_qos_profiles": dump_qos_v9([topic.qos]),
                    "type_description_hash": _Quoted(topic.type_hash),
                },
                "message_count": topic.count,
            }
            for topic in topics
        ],
        # Compression by rosbag2 applies to files or single messages, not to the chunks of MCAP.
        "compression_format": _Quoted(""),
        "compression_mode": _Quoted(""),
        "relative_file_paths": [file],
        "files": [{"path": file, "starting_time": start, "duration": duration, "message_count": count}],
        "custom_data": {key: _Quoted(value) for key, value in custom.items()},
        "ros_distro": distro,
    }


def as_yaml(values: Mapping[str, Any]) -> str:
    """Return the metadata as YAML text."""
    return yaml.dump(dict(values), Dumper=_Dumper, sort_keys=False, width=10**6, allow_unicode=True)


def write_metadata(directory: Path, values: Mapping[str, Any]) -> None:
    """Write metadata.yaml into a bag directory atomically."""
    target = directory / FILE_NAME
    part = target.with_suffix(".yaml.part")
    try:
        part.write_text(as_yaml({ROOT: values}), encoding="utf-8")
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def read_metadata(directory: Path) -> dict[str, Any]:
    """Return the contents of metadata.yaml below its root key; empty if the file is missing or cannot be read."""
    try:
        values = parsed(read_text(directory / FILE_NAME)).get(ROOT)
    except DocumentError:
        return {}
    return values if isinstance(values, dict) else {}


def parsed(text: str) -> dict[str, Any]:
    """Return the mapping in a YAML text; empty if the text cannot be parsed or is not a mapping."""
    try:
        values = parse_yaml(text)
    except DocumentError:
        return {}
    return values if isinstance(values, dict) else {}


def custom_data(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data in the metadata as texts; empty if there are none."""
    found = values.get("custom_data")
    return {str(key): str(value) for key, value in found.items()} if isinstance(found, dict) else {}


def file_names(values: Mapping[str, Any]) -> list[str]:
    """Return the bag's files as the metadata name them, in their order; old versions of rosbag2 wrote paths."""
    names = values.get("relative_file_paths")
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def message_counts(values: Mapping[str, Any]) -> dict[str, int]:
    """Return {file name in the metadata: number of messages} for each file of which the metadata state the number."""
    files = values.get("files")
    entries = [entry for entry in files if isinstance(entry, dict)] if isinstance(files, list) else []
    counts = {str(entry.get("path")): entry.get("message_count") for entry in entries}
    return {name: count for name, count in counts.items() if isinstance(count, int)}
