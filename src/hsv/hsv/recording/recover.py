"""Making a proper bag of what a killed writer left."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema
from mcap.writer import Writer

from hsv.errors import RecordingError
from hsv.recording.metadata import CUSTOM_DATA, FILE_NAME, write_metadata
from hsv.recording.reader import Bag
from hsv.recording.scan import MESSAGE_HEADER, content, records
from hsv.recording.writer import CHUNK_BYTES

RECOVERED = {"recovered": "true"}
"""Custom data of a recovered bag: its end is not the end of the run."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a recovery did."""

    path: Path
    messages: int
    """Number of messages kept."""
    changed: bool
    """False if the bag was complete already."""


def recover(path: Path | str) -> Recovery:
    """Keep everything complete of a bag whose writer was killed, with summary, indexes and metadata.yaml.

    A new file is written beside the old one and takes its place when it is whole; a recovery that is itself
    interrupted leaves the bag as it was. A bag that only lacks its metadata.yaml gets that, a complete one is left.

    Parameters
    ----------
    path
        A bag directory, or the MCAP file in it.

    Raises:
    ------
    RecordingError
        If nothing of the bag can be read; see :class:`hsv.recording.reader.Bag`.
    """
    bag = Bag(path)
    messages = sum(topic.count for topic in bag.topics.values())
    changed = not bag.complete or not (bag.path.parent / FILE_NAME).exists()
    if not bag.complete:
        _rewrite(bag.path)
    if changed:
        write_metadata(bag.path)
    return Recovery(bag.path, messages, changed)


def _rewrite(path: Path) -> None:
    beside = path.with_suffix(".mcap.part")
    try:
        with beside.open("wb") as stream:
            writer = Writer(stream, chunk_size=CHUNK_BYTES)
            writer.start(profile="ros2")
            _copy(path, writer)
            writer.add_metadata(CUSTOM_DATA, RECOVERED)
            writer.finish()
            stream.flush()
            os.fsync(stream.fileno())
        beside.replace(path)
    except OSError as error:
        raise RecordingError(f"{beside}: cannot be written: {error.strerror}") from None


def _copy(path: Path, writer: Writer) -> None:
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for opcode, body in records(path):
        match opcode:
            case Opcode.MESSAGE:
                channel_id, sequence, log_time, publish_time = MESSAGE_HEADER.unpack_from(body)
                data = bytes(body[MESSAGE_HEADER.size :])
                writer.add_message(channels[channel_id], log_time, data, publish_time, sequence)
            case Opcode.SCHEMA:
                schema = Schema.read(content(body))
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            case Opcode.CHANNEL:
                channel = Channel.read(content(body))
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
                )
            case Opcode.ATTACHMENT:
                kept = Attachment.read(content(body))
                writer.add_attachment(kept.create_time, kept.log_time, kept.name, kept.media_type, kept.data)
            case Opcode.METADATA:
                metadata = Metadata.read(content(body))
                writer.add_metadata(metadata.name, metadata.metadata)
            case Opcode.DATA_END:
                return  # what follows repeats schemas and channels: killed while it wrote the summary
