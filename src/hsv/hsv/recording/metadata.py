"""The metadata.yaml of a bag directory (rosbag2, version 9), made from its MCAP file alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from mcap.reader import SeekingReader
from mcap.records import Statistics

CUSTOM_DATA = "custom_data"
"""Name of the MCAP metadata records that hold the custom data; a later record adds to the earlier ones."""
FILE_NAME = "metadata.yaml"
VERSION = 9
DISTRO = "jazzy"
EMPTY_BAG_START = 2**63 - 1
"""What rosbag2 writes as the starting time of a bag without messages."""


class _Quoted(str):
    """Text written in double quotes: empty text must not become null, nor a commit such as 12e5 a number."""

    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    pass


_Dumper.add_representer(
    _Quoted, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"')
)


def write_metadata(mcap: Path) -> None:
    """Write metadata.yaml beside a finished MCAP file, atomically."""
    text = yaml.dump(_information(mcap), Dumper=_Dumper, sort_keys=False, width=10**6, allow_unicode=True)
    target = mcap.parent / FILE_NAME
    beside = target.with_suffix(".yaml.part")
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


def _information(mcap: Path) -> dict[str, Any]:
    with mcap.open("rb") as stream:
        reader = SeekingReader(stream)
        summary = reader.get_summary()
        custom: dict[str, str] = {}
        for record in reader.iter_metadata():
            if record.name == CUSTOM_DATA:
                custom |= record.metadata
    assert summary is not None and summary.statistics is not None, "a finished file has a summary"
    statistics = summary.statistics
    start, duration = _span(statistics)
    topics = [
        {
            "topic_metadata": {
                "name": channel.topic,
                "type": summary.schemas[channel.schema_id].name,
                "serialization_format": channel.message_encoding,
                "offered_qos_profiles": yaml.safe_load(channel.metadata.get("offered_qos_profiles", "[]")),
                "type_description_hash": _Quoted(channel.metadata.get("topic_type_hash", "")),
            },
            "message_count": statistics.channel_message_counts.get(channel.id, 0),
        }
        for channel in summary.channels.values()
    ]
    return {
        "rosbag2_bagfile_information": {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": duration},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": statistics.message_count,
            "topics_with_message_count": topics,
            # Compression in the sense of rosbag2: of whole files or single messages. MCAP chunks do not count.
            "compression_format": _Quoted(""),
            "compression_mode": _Quoted(""),
            "relative_file_paths": [mcap.name],
            "files": [
                {
                    "path": mcap.name,
                    "starting_time": {"nanoseconds_since_epoch": start},
                    "duration": {"nanoseconds": duration},
                    "message_count": statistics.message_count,
                }
            ],
            "custom_data": {key: _Quoted(value) for key, value in custom.items()},
            "ros_distro": DISTRO,
        }
    }


def _span(statistics: Statistics) -> tuple[int, int]:
    if statistics.message_count == 0:
        return EMPTY_BAG_START, 0
    return statistics.message_start_time, statistics.message_end_time - statistics.message_start_time
