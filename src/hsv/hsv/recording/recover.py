"""Making a proper bag of what a killed writer left."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema
from mcap.writer import Writer

from hsv.errors import RecordingError
from hsv.recording.metadata import CUSTOM_DATA, FILE_NAME, write_metadata
from hsv.recording.reader import Bag, find_mcap
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
        If its recorder still runs, nothing of the bag can be read (see :class:`hsv.recording.reader.Bag`), or there is
        no space left.
    """
    mcap = find_mcap(Path(path))
    with _nobody_writing(mcap):
        bag = Bag(mcap)
        messages = sum(topic.count for topic in bag.topics.values())
        changed = not bag.complete or not (mcap.parent / FILE_NAME).exists()
        try:
            if not bag.complete:
                _rewrite(mcap)
            if changed:
                write_metadata(mcap)
        except OSError as error:
            raise RecordingError(f"{mcap}: cannot be mended: {error.strerror}") from None
    return Recovery(mcap, messages, changed)


@contextmanager
def _nobody_writing(mcap: Path) -> Iterator[None]:
    try:
        stream = mcap.open("rb")
    except OSError as error:
        raise RecordingError(f"{mcap}: cannot be read: {error.strerror}") from None
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RecordingError(f"{mcap}: is being recorded, expected a bag whose recorder has ended") from None
        except OSError:
            pass  # a file system without locks
        yield


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
    finally:
        beside.unlink(missing_ok=True)


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
