"""Metadata of a bag for rosbag2 (version 9): metadata.yaml, and the same as a record in the MCAP file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from hsv.base.errors import DocumentError
from hsv.base.files import parse_yaml, read_text

CUSTOM_DATA = "custom_data"
"""Name of the MCAP metadata records that hold the custom data; a later record adds to the earlier ones."""
ROSBAG2 = "rosbag2"
"""Name of the MCAP metadata records of rosbag2."""
SERIALIZED = "serialized_metadata"
"""Their key: the text of metadata.yaml without its root."""
FILE_NAME = "metadata.yaml"
ROOT = "rosbag2_bagfile_information"
VERSION = 9
DISTRO = "jazzy"
EMPTY_BAG_START = 2**63 - 1
"""Starting time that rosbag2 writes for a bag without messages."""


@dataclass
class Tally:
    """Number of messages, and the first and last log time in nanoseconds; to be counted up message by message."""

    count: int = 0
    start: int = EMPTY_BAG_START
    end: int = 0

    def add(self, time: int) -> None:
        """Count a message."""
        self.count += 1
        self.start = min(self.start, time)
        self.end = max(self.end, time)

    @classmethod
    def of(cls, parts: Iterable[Tally]) -> Tally:
        """Return the tally of all ``parts`` together."""
        counted = [part for part in parts if part.count]
        return cls(
            sum(part.count for part in counted),
            min((part.start for part in counted), default=EMPTY_BAG_START),
            max((part.end for part in counted), default=0),
        )

    @property
    def duration(self) -> int:
        """Nanoseconds from the first message to the last."""
        return max(self.end - self.start, 0)


@dataclass(frozen=True)
class TopicInformation:
    """A topic as metadata.yaml lists it."""

    name: str
    type: str
    qos: str
    """The offered profiles, as YAML."""
    type_hash: str
    messages: int
    encoding: str = "cdr"


class _Quoted(str):
    """Text written in double quotes: empty text must not become null, nor a commit such as 12e5 a number."""

    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    pass


_Dumper.add_representer(
    _Quoted, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"')
)


def information(
    file: str, tally: Tally, topics: Sequence[TopicInformation], custom: Mapping[str, str], distro: str = DISTRO
) -> dict[str, Any]:
    """Return the metadata of a bag of one file, with every key that rosbag2 demands."""
    start, duration = {"nanoseconds_since_epoch": tally.start}, {"nanoseconds": tally.duration}
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": dict(duration),
        "starting_time": dict(start),
        "message_count": tally.count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": topic.encoding,
                    "offered_qos_profiles": parse_yaml(topic.qos or "[]"),
                    "type_description_hash": _Quoted(topic.type_hash),
                },
                "message_count": topic.messages,
            }
            for topic in topics
        ],
        # Compression in the sense of rosbag2: of whole files or single messages. MCAP chunks do not count.
        "compression_format": _Quoted(""),
        "compression_mode": _Quoted(""),
        "relative_file_paths": [file],
        "files": [{"path": file, "starting_time": start, "duration": duration, "message_count": tally.count}],
        "custom_data": {key: _Quoted(value) for key, value in custom.items()},
        "ros_distro": distro,
    }


def record(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the content of rosbag2's MCAP metadata record."""
    return {SERIALIZED: _text(values)}


def write_metadata(directory: Path, values: Mapping[str, Any]) -> None:
    """Write metadata.yaml into a bag directory, atomically."""
    target = directory / FILE_NAME
    beside = target.with_suffix(".yaml.part")
    try:
        beside.write_text(_text({ROOT: values}), encoding="utf-8")
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


def read_metadata(directory: Path) -> dict[str, Any]:
    """Return what metadata.yaml says below its root; nothing if it is missing or cannot be read."""
    try:
        return parsed(read_text(directory / FILE_NAME), ROOT)
    except DocumentError:
        return {}


def parsed(text: str, root: str = "") -> dict[str, Any]:
    """Return the mapping that YAML text holds, below its ``root`` if one is given; an empty one if there is none."""
    try:
        values = parse_yaml(text)
    except DocumentError:
        return {}
    if root:
        values = values.get(root) if isinstance(values, dict) else None
    return values if isinstance(values, dict) else {}


def custom_data(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data that metadata hold; those that are none are left out."""
    found = values.get("custom_data")
    return {str(key): str(value) for key, value in found.items()} if isinstance(found, dict) else {}


def file_names(values: Mapping[str, Any]) -> list[str]:
    """Return the files of the bag that metadata name, in their order."""
    names = values.get("relative_file_paths")
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def message_counts(values: Mapping[str, Any]) -> dict[str, int]:
    """Return the number of messages by file name that metadata tell of."""
    files = values.get("files")
    entries = [entry for entry in files if isinstance(entry, dict)] if isinstance(files, list) else []
    counts = {str(entry.get("path")): entry.get("message_count") for entry in entries}
    return {name: count for name, count in counts.items() if isinstance(count, int)}


def _text(values: Mapping[str, Any]) -> str:
    return yaml.dump(dict(values), Dumper=_Dumper, sort_keys=False, width=10**6, allow_unicode=True)
