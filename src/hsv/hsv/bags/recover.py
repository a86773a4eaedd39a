"""Recovery of truncated or damaged bags, as left by a killed writer or a damaged disk."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema
from mcap.writer import Writer

from hsv.bags.files import Unpacker, find_files, locked
from hsv.bags.metadata import (
    CUSTOM_DATA,
    FILE_NAME,
    ROSBAG2,
    Tally,
    TopicInformation,
    file_names,
    information,
    message_counts,
    read_metadata,
    record,
    write_metadata,
)
from hsv.bags.reader import Bag
from hsv.bags.scan import MESSAGE_HEADER, Scan, content
from hsv.bags.topic import repaired_profiles
from hsv.bags.writer import CHUNK_BYTES, mcap_path
from hsv.base.errors import RecordingError

_PROFILES = "offered_qos_profiles"
"""Key of the quality of service in the metadata of a channel."""

RECOVERED = {"recovered": "true"}
"""Custom data that mark a recovered bag, whose end may not be the end of the run."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """Result of a recovery."""

    bag: Bag
    """The original bag."""
    path: Path
    """Directory of the new bag, or of the original if it was complete."""
    messages: int
    """Number of messages in the result."""
    changed: bool
    """Whether a new bag was written."""


def recover(path: Path | str, target: Path | None = None) -> Recovery:
    """Write a new bag with all intact data of a truncated or damaged bag; the original is not modified.

    The new bag has one file with summary and indexes, and metadata.yaml. A complete bag is not copied.

    Args:
        path: A bag directory, or a file in it.
        target: The new bag directory; default: the original's name with ``_recovered``, in the same folder.

    Raises:
        RecordingError: The recorder of the bag still runs, nothing of the bag can be read (see
            :class:`hsv.bags.reader.Bag`), the target exists, or there is no space left.
    """
    with _exclusively(find_files(Path(path))[0]):
        bag = Bag(path)
        messages = sum(topic.count for topic in bag.topics.values())
        if bag.complete and not bag.loss and _has_its_metadata(bag, messages):
            return Recovery(bag, bag.folder, messages, changed=False)
        folder = bag.folder.absolute()
        target = (target or folder.with_name(f"{folder.name}_recovered")).absolute()
        try:
            target.mkdir(parents=True)
        except FileExistsError:
            raise RecordingError(f"out = {str(target)!r}: exists already, expected a new bag directory") from None
        except OSError as error:
            raise RecordingError(f"out = {str(target)!r}: cannot be made: {error.strerror}") from None
        try:
            write_metadata(target, _rewrite(bag, mcap_path(target)))
        except BaseException as error:
            for part in (mcap_path(target), target / FILE_NAME):
                part.unlink(missing_ok=True)
            target.rmdir()
            if isinstance(error, OSError):
                raise RecordingError(f"out = {str(target)!r}: cannot be written: {error.strerror}") from None
            raise
    return Recovery(bag, target, messages, changed=True)


def finalise(directory: Path) -> None:
    """Complete the bag of a killed recorder in place.

    The new file replaces the old one only when it is complete, so that an interrupted call leaves the bag unchanged.

    Raises:
        RecordingError: The recorder of the bag still runs, nothing of the bag can be read, the bag is damaged, or there
            is no space left.
    """
    with _exclusively(find_files(directory)[0]):
        bag = Bag(directory)
        if bag.loss:
            raise RecordingError(f"{bag.path}: is damaged, hsv recover makes a new bag of what is whole")
        (mcap,) = bag.files
        part = mcap.with_suffix(".mcap.part")
        try:
            values = _rewrite(bag, part, mcap.name)
            part.replace(mcap)
            write_metadata(directory, values)
        except OSError as error:
            raise RecordingError(f"{mcap}: cannot be repaired: {error.strerror}") from None
        finally:
            part.unlink(missing_ok=True)


def _has_its_metadata(bag: Bag, messages: int) -> bool:
    values = read_metadata(bag.folder)
    names = [file.name for file in bag.files]
    counts = message_counts(values)
    return (
        [name for name in file_names(values) if Path(name).name in names] != []
        and values.get("storage_identifier") == "mcap"
        and sum(counts.get(name, 0) for name in names) == messages
    )


@contextmanager
def _exclusively(files: list[Path]) -> Iterator[None]:
    """Hold the locks of ``files``, which their recorder holds while it runs."""
    with ExitStack() as stack:
        for file in files:
            try:
                stream = stack.enter_context(file.open("rb"))
            except OSError as error:
                raise RecordingError(f"{file}: cannot be read: {error.strerror}") from None
            if not locked(stream):
                raise RecordingError(f"{file}: is being recorded, expected a bag whose recorder has ended")
        yield


def _rewrite(bag: Bag, path: Path, name: str = "") -> dict[str, Any]:
    """Write the intact data of ``bag`` to the file ``path``; return the metadata, which call it ``name``."""
    custom = bag.custom_data | RECOVERED
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=CHUNK_BYTES)
        writer.start(profile="ros2")
        copy = _Copy(writer)
        for file in bag.files:
            copy.add(Unpacker(file))
        values = information(name or path.name, *copy.tallied(), custom, bag.distro)
        writer.add_metadata(CUSTOM_DATA, custom)
        writer.add_metadata(ROSBAG2, record(values))
        writer.finish()
        stream.flush()
        os.fsync(stream.fileno())
    return values


class _Copy:
    """A copy of several files into one, with equal schemas and channels merged."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[str, int] = {}
        self._topics: dict[str, tuple[Channel, Schema]] = {}
        self._tallies: dict[str, Tally] = {}

    def add(self, file: Unpacker) -> None:
        """Copy the intact data of a file."""
        found = list(Scan(file).records())
        schemas: dict[int, Schema] = {}
        numbers: dict[int, tuple[int, Tally]] = {}
        # Read definitions first, because in a file with a damaged beginning they are at the end.
        for schema in (Schema.read(content(body)) for opcode, body in found if opcode == Opcode.SCHEMA):
            schemas.setdefault(schema.id, schema)  # the first has the checksum of its chunk
        for channel in (Channel.read(content(body)) for opcode, body in found if opcode == Opcode.CHANNEL):
            if channel.id not in numbers and channel.schema_id in schemas:
                numbers[channel.id] = self._channel(channel, schemas[channel.schema_id])
        for opcode, body in found:
            match opcode:
                case Opcode.MESSAGE:
                    number, sequence, log_time, publish_time = MESSAGE_HEADER.unpack_from(body)
                    if number not in numbers:
                        continue
                    message = file.message(bytes(body[MESSAGE_HEADER.size :]))
                    if message is None:
                        continue
                    channel_id, tally = numbers[number]
                    self._writer.add_message(channel_id, log_time, message, publish_time, sequence)
                    tally.add(log_time)
                case Opcode.ATTACHMENT:
                    kept = Attachment.read(content(body))
                    self._writer.add_attachment(kept.create_time, kept.log_time, kept.name, kept.media_type, kept.data)
                case Opcode.METADATA:
                    metadata = Metadata.read(content(body))
                    if metadata.name not in (CUSTOM_DATA, ROSBAG2):  # written anew at the end
                        self._writer.add_metadata(metadata.name, metadata.metadata)

    def tallied(self) -> tuple[Tally, list[TopicInformation]]:
        """Return the tally of the copied messages and the copied topics for metadata.yaml."""
        topics = [
            TopicInformation(
                name,
                schema.name,
                channel.metadata.get(_PROFILES, ""),
                channel.metadata.get("topic_type_hash", ""),
                self._tallies[name].count,
                channel.message_encoding,
            )
            for name, (channel, schema) in self._topics.items()
        ]
        return Tally.of(self._tallies.values()), topics

    def _channel(self, channel: Channel, schema: Schema) -> tuple[int, Tally]:
        key = (schema.name, schema.encoding, schema.data)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(*key)
        name = channel.topic
        if name not in self._channels:
            profiles = repaired_profiles(channel.metadata.get(_PROFILES, ""))
            channel = replace(channel, metadata={**channel.metadata, _PROFILES: profiles})
            self._topics[name] = channel, schema
            self._tallies[name] = Tally()
            self._channels[name] = self._writer.register_channel(
                name, channel.message_encoding, self._schemas[key], channel.metadata
            )
        return self._channels[name], self._tallies[name]
