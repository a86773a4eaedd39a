"""Reading a bag, also one whose writer was killed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema
from numpy.typing import NDArray
from rosbags.interfaces.typing import ConstValue
from rosbags.typesys.store import Typestore

from hsv.errors import RecordingError
from hsv.graph.description import OTHER_TOPICS, TOPICS
from hsv.recording.columns import Columns
from hsv.recording.metadata import CUSTOM_DATA
from hsv.recording.scan import DAMAGE, MESSAGE_HEADER, attachment, content, records
from hsv.recording.topic import Qos
from hsv.recording.track import Track
from hsv.recording.typestore import message_types

NAMESPACE = "/hsv/"
"""A bag of this project has topics below this name."""


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic as found in a bag."""

    name: str
    type: str
    count: int
    type_hash: str


class Bag:
    """A recorded run: its topics, messages, attachments and custom data.

    Parameters
    ----------
    path
        A bag directory, or the MCAP file in it.

    Raises:
    ------
    RecordingError
        If there is no such bag, it is no MCAP file, it is damaged or cut off before its first messages, or it is not
        of this project.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = find_mcap(Path(path))
        self.complete = False
        """Whether the writer closed the file; a killed writer leaves one that :mod:`hsv.recording.recover` mends."""
        self.attachments: dict[str, bytes] = {}
        self.media_types: dict[str, str] = {}
        """Media type of each attachment."""
        self.custom_data: dict[str, str] = {}
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._messages: dict[int, tuple[list[int], list[bytes]]] = {}
        """By channel; channels of one topic share theirs, in the order of the file."""
        self._columns: dict[str, Columns] = {}
        try:
            self._read()
        except (*DAMAGE, KeyError) as error:
            raise RecordingError(f"{self.path}: is damaged ({str(error) or type(error).__name__})") from None
        self._check()

    @property
    def topics(self) -> dict[str, RecordedTopic]:
        """The topics by name, those without messages included."""
        return {
            channel.topic: RecordedTopic(
                channel.topic,
                self._schemas[channel.schema_id].name,
                len(self._messages[channel.id][0]),
                channel.metadata.get("topic_type_hash", ""),
            )
            for channel in self._channels.values()
        }

    @cached_property
    def span(self) -> tuple[int, int]:
        """First and last time in the bag in nanoseconds; zeros if it holds no message."""
        times = [(min(times), max(times)) for times, _ in self._messages.values() if times]
        return (min(first for first, _ in times), max(last for _, last in times)) if times else (0, 0)

    def times(self, topic: str) -> NDArray[np.int64]:
        """Return the times of the messages of a topic, shape (n,), in nanoseconds."""
        return np.array(self._of(topic)[0], np.int64)

    def messages(self, topic: str) -> list[tuple[int, bytes]]:
        """Return the messages of a topic as recorded: time in nanoseconds and CDR with its header."""
        return list(zip(*self._of(topic), strict=True))

    def columns(self, topic: str) -> Columns:
        """Return all messages of a topic, decoded, one array per field.

        Returns:
        -------
        Columns
            Arrays with the messages along the first axis, by field path; see :mod:`hsv.recording.columns`. They are
            decoded once: whoever asks again gets the same.

        Raises:
        ------
        RecordingError
            If the topic is not in the bag or a message does not fit its definition.
        """
        if topic not in self._columns:
            self._columns[topic] = self.track(topic).columns()
        return self._columns[topic]

    def decode(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield time in nanoseconds and message of a topic, deserialized one by one.

        Raises:
        ------
        RecordingError
            As :meth:`columns`.
        """
        return self.track(topic).decode()

    def track(self, topic: str) -> Track:
        """Return the messages of a topic with what decodes them.

        Raises:
        ------
        RecordingError
            If the topic is not in the bag.
        """
        times, messages = self._of(topic)
        return Track(topic, self.topics[topic].type, self.types, times, messages, str(self.path))

    def text(self, name: str) -> str:
        """Return an attachment as text.

        Raises:
        ------
        RecordingError
            If it is not in the bag or no text.
        """
        if name not in self.attachments:
            raise RecordingError(f"{self.path}: no attachment {name}, expected a bag recorded by hsv run")
        try:
            return self.attachments[name].decode()
        except UnicodeDecodeError as error:
            raise RecordingError(f"{self.path}: attachment {name}: {error}, expected text") from None

    def definition(self, topic: str) -> str:
        """Return the definition of a topic's type as recorded, its dependencies included."""
        self._of(topic)
        return next(self._definitions[c.schema_id] for c in self._channels.values() if c.topic == topic)

    def qos(self, topic: str) -> Qos:
        """Return the quality of service with which a topic was offered; the default if the bag does not tell."""
        self._of(topic)
        metadata = next(c.metadata for c in self._channels.values() if c.topic == topic)
        return Qos.from_yaml(metadata.get("offered_qos_profiles", ""))

    def constants(self, topic: str) -> dict[str, ConstValue]:
        """Return the constants that the type of a topic defines, as recorded in the bag."""
        self._of(topic)
        return {name: value for name, _, value in self.types.fielddefs[self.topics[topic].type][0]}

    @cached_property
    def types(self) -> Typestore:
        """The message types as the bag's own definitions state them."""
        definitions = [(schema.name, self._definitions[schema.id]) for schema in self._schemas.values()]
        return message_types(definitions, str(self.path))

    @cached_property
    def _definitions(self) -> dict[int, str]:
        """Text of each schema, by its id."""
        try:
            return {schema.id: schema.data.decode() for schema in self._schemas.values()}
        except UnicodeDecodeError as error:
            raise RecordingError(f"{self.path}: a definition of a message is no text: {error}") from None

    def _of(self, topic: str) -> tuple[list[int], list[bytes]]:
        for channel in self._channels.values():
            if channel.topic == topic:
                return self._messages[channel.id]
        raise RecordingError(f"{self.path}: no topic {topic}, only {', '.join(sorted(self.topics))}")

    def _read(self) -> None:
        unpack, size = MESSAGE_HEADER.unpack_from, MESSAGE_HEADER.size
        for opcode, body in records(self.path):
            match opcode:
                case Opcode.MESSAGE:
                    channel_id, _, time, _ = unpack(body)
                    times, messages = self._messages[channel_id]
                    times.append(time)
                    messages.append(bytes(body[size:]))
                case Opcode.SCHEMA:
                    schema = Schema.read(content(body))
                    self._schemas[schema.id] = schema
                case Opcode.CHANNEL:
                    channel = Channel.read(content(body))
                    first = next((c.id for c in self._channels.values() if c.topic == channel.topic), channel.id)
                    self._channels[channel.id] = channel
                    self._messages.setdefault(channel.id, self._messages.setdefault(first, ([], [])))
                case Opcode.ATTACHMENT:
                    attached = attachment(body)
                    self.attachments[attached.name] = attached.data
                    self.media_types[attached.name] = attached.media_type
                case Opcode.METADATA:
                    metadata = Metadata.read(content(body))
                    if metadata.name == CUSTOM_DATA:
                        self.custom_data |= metadata.metadata
                case Opcode.FOOTER:
                    self.complete = True

    def _check(self) -> None:
        if not self._channels and not self.complete:
            raise RecordingError(f"{self.path}: is cut off before its first messages")
        if not any(channel.topic.startswith(NAMESPACE) for channel in self._channels.values()):
            raise RecordingError(f"{self.path}: has no topic below {NAMESPACE}, expected a bag of this project")
        known = TOPICS | OTHER_TOPICS
        found: dict[str, Schema] = {}
        for channel in self._channels.values():
            schema = self._schemas.get(channel.schema_id)
            if schema is None or (schema.encoding, channel.message_encoding) != ("ros2msg", "cdr"):
                raise RecordingError(f"{self.path}: topic {channel.topic}: expected a ROS 2 message in CDR")
            if schema.name != (expected := known.get(channel.topic, schema.name)):
                raise RecordingError(f"{self.path}: topic {channel.topic} is {schema.name}, expected {expected}")
            first = found.setdefault(channel.topic, schema)
            if (schema.name, schema.data) != (first.name, first.data):
                raise RecordingError(f"{self.path}: topic {channel.topic}: recorded with two definitions, expected one")


def find_mcap(path: Path) -> Path:
    """Return the MCAP file of a bag directory, or the file itself.

    Raises:
    ------
    RecordingError
        If there is none, or more than one.
    """
    if path.is_file():
        return path
    if not path.is_dir():
        raise RecordingError(f"{path}: does not exist, expected a bag directory or an MCAP file")
    found = sorted(path.glob("*.mcap"))
    if len(found) != 1:
        raise RecordingError(f"{path}: holds {len(found)} files *.mcap, expected a bag directory with one")
    return found[0]
