"""Read a bag of hsv or ``ros2 bag`` with one file or several, compressed or not, complete or damaged."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from heapq import merge
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from numpy.typing import NDArray
from rosbags.interfaces.typing import ConstValue
from rosbags.typesys.store import Typestore

from hsv.bags import metadata
from hsv.bags.columns import Columns, Track
from hsv.bags.definitions import message_types
from hsv.bags.description import INTERFACE_VERSION, LATCHED_TOPICS, ROOT, ROSOUT, RUN, TOPICS, resolved
from hsv.bags.files import Unpacker, find_files
from hsv.bags.metadata import DISTRO, Topic, recorded_qos
from hsv.bags.roles import TYPES, namespace_of, roles
from hsv.bags.scan import Scan
from hsv.bags.units import Units, units_of
from hsv.base.errors import RecordingError

if TYPE_CHECKING:
    from pandas import DataFrame

_OURS = "/hsv/"
"""Part of the full name of this project's topics in any namespace, unless they are remapped."""
_USUAL = {resolved(role): kind for role, kind in TYPES.items()}
"""Types of the topics of a graph by their default names, without namespace or remapping."""
_STAMP_START, _STAMP_END = 4, 12
"""First byte of the stamp in a message of a step, and the byte after it: seconds and nanoseconds, four bytes each."""
_BIG_ENDIAN = b"\x00\x00"


@dataclass
class Loss:
    """Known losses of a bag."""

    files: list[str] = field(default_factory=list)
    """Names of the missing files."""
    damages: list[tuple[Path, int, str]] = field(default_factory=list)
    """File, offset and description of each damage."""
    messages: int = 0
    """Number of recorded messages that cannot be read."""
    attachments: int = 0
    counted: bool = True
    """Whether the numbers are exact; otherwise they are lower bounds."""

    def __bool__(self) -> bool:
        return bool(self.files or self.damages or self.messages or self.attachments)


class Bag:
    """A recorded run: its topics, messages, attachments and custom data.

    All times are simulated times in nanoseconds. The time of a message of a step topic is its stamp; that of another
    message is its log time if the recorder used simulated time, otherwise the latest stamp received by then. Damaged
    parts are skipped; see :attr:`loss`.

    Methods accept the name of a topic in the bag, such as ``/veh1/hsv/state``, or its role, such as ``hsv/state``. They
    raise a RecordingError if the topic is not in the bag, or a message does not fit its definition.

    Args:
        path: A bag directory, or a file in it to read alone.

    Raises:
        RecordingError: The bag does not exist, is not an MCAP file, cannot be read, is not of this project, or has
            another interface version.
    """

    def __init__(self, path: Path | str) -> None:
        given = Path(path)
        self.files, missing = find_files(given)
        """The files of the bag in their order."""
        self.path = self.files[0] if len(self.files) == 1 and not missing else given
        """The file, or the directory of several files."""
        self.folder = self.files[0].parent
        """The bag directory."""
        self.complete = not missing
        """Whether no file is missing and the writer closed every file; a killed writer leaves a truncated file."""
        self.loss = Loss(files=missing)
        self.contradictions: list[str] = []
        """Texts on each statement of metadata.yaml that contradicts the files; the contents of the files are used."""
        self.attachments: dict[str, bytes] = {}
        self.media_types: dict[str, str] = {}
        """Media type of each attachment."""
        self.custom_data: dict[str, str] = {}
        self.distro = DISTRO
        """ROS 2 distribution of the recorder."""
        self.roles: dict[str, str] = {}
        """Names of the topics by their role, see :mod:`hsv.bags.description`."""
        self.namespace = ROOT
        """Namespace of the graph."""
        self.topics: dict[str, Topic] = {}
        """The topics by name, including topics without messages."""
        self.undecodable: dict[str, Topic] = {}
        """Topics of other programs whose messages are not ROS 2 messages in CDR; only a recovery copies them."""
        self._messages: dict[str, list[Message]] = defaultdict(list)
        self._columns: dict[str, Columns] = {}
        self._stamps: dict[str, NDArray[np.int64]] = {}
        self._read()
        self._check()

    def name_of(self, role: str) -> str:
        """Return the name of the topic in ``role``, or its default name if the bag has no such topic."""
        return self.roles.get(role) or resolved(role, self.namespace)

    @cached_property
    def span(self) -> tuple[int, int]:
        """First and last time in the bag, ns; (0, 0) without messages."""
        times = [(int(times.min()), int(times.max())) for times in map(self.times, self.topics) if len(times)]
        return (min(first for first, _ in times), max(last for _, last in times)) if times else (0, 0)

    def times(self, topic: str) -> NDArray[np.int64]:
        """Return the simulated times of the messages of a topic, ns, shape (n,)."""
        name = self._topic(topic).name
        if name in self._step_topics:
            if name not in self._stamps:
                self._stamps[name] = self._stamps_in(name, self._data(name))
            return self._stamps[name]
        log_times = self._log_times(name)
        received, stamps = self._clock
        if np.array_equal(received.astype(np.int64), stamps):
            return log_times.astype(np.int64)  # the recorder used simulated time
        before = np.searchsorted(received, log_times, side="right") - 1
        return np.asarray(stamps[np.maximum(before, 0)])

    def messages(self, topic: str) -> list[tuple[int, bytes]]:
        """Return each recorded message of a topic as a pair: simulated time (ns), and bytes in CDR with its header."""
        return list(zip(self.times(topic).tolist(), self._data(self.name_of(topic)), strict=True))

    def recorded(self) -> Iterator[tuple[str, Message]]:
        """Yield (topic name, MCAP record) of all intact messages, also of undecodable topics, in order of log time."""
        topics = ([(topic, message) for message in messages] for topic, messages in self._messages.items())
        return merge(*topics, key=lambda found: found[1].log_time)

    def columns(self, topic: str) -> Columns:
        """Return all messages of a topic as arrays by field path, see :mod:`hsv.bags.columns`; they are cached."""
        name = self.name_of(topic)
        if name not in self._columns:
            self._columns[name] = self.track(topic).columns()
        return self._columns[name]

    def to_frame(self, topic: str) -> DataFrame:
        """Return the messages of a topic as a pandas table; the index is the simulated time (s).

        There is a column for each number, such as ``altitude`` or ``values[0]``. ``attrs["units"]`` has their units as
        recorded. Nothing that the bag contains is run.
        """
        from pandas import DataFrame, Index

        columns, units, recorded = {}, {}, self.units(topic)
        for name, values in self.columns(topic).items():
            rows = values.T if values.ndim > 1 else [values]
            for index, row in enumerate(rows):
                key = f"{name}[{index}]" if values.ndim > 1 else name
                columns[key], units[key] = row, recorded[name].of(index)
        frame = DataFrame(columns, index=Index(self.times(topic) * 1e-9, name="time"))
        frame.attrs["units"] = {"time": "s", **units}
        return frame

    def units(self, topic: str) -> dict[str, Units]:
        """Return the units of the fields of a topic, by field path as in :meth:`columns`."""
        found = self._topic(topic)
        return units_of(found.definition, self.types.fielddefs, found.type)

    def decode(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield each message of a topic as a pair: simulated time (ns), and deserialized message."""
        return self.track(topic).decode()

    def track(self, topic: str) -> Track:
        """Return the messages of a topic with their definitions."""
        found = self._topic(topic)
        if found.type not in self.types.fielddefs:
            raise RecordingError(f"{self.path}: topic {found.name}: the definition of {found.type} cannot be used")
        times, data = self.times(topic).tolist(), self._data(found.name)
        return Track(found.name, found.type, self.types, times, data, str(self.path))

    def text(self, name: str) -> str:
        """Return an attachment as text; raise a RecordingError if it is missing or not text."""
        if name not in self.attachments:
            raise RecordingError(f"{self.path}: no attachment {name}, expected a bag recorded by hsv run")
        try:
            return self.attachments[name].decode()
        except UnicodeDecodeError as error:
            raise RecordingError(f"{self.path}: attachment {name}: {error}, expected text") from None

    def constants(self, topic: str) -> dict[str, ConstValue]:
        """Return {name: value} of the constants in the recorded definition of a topic's type."""
        return {name: value for name, _, value in self.types.fielddefs[self._topic(topic).type][0]}

    def constant(self, topic: str, name: str) -> ConstValue:
        """Return a constant in the recorded definition of a topic's type, or raise a RecordingError if missing."""
        found = self.constants(topic)
        if name not in found:
            raise RecordingError(f"{self.path}: definition of {self._topic(topic).type}: no constant {name}")
        return found[name]

    @cached_property
    def types(self) -> Typestore:
        """The message types, from the definitions in the bag."""
        ours: dict[str, str] = {}
        others: dict[str, str] = {}
        for name, topic in self.topics.items():
            (ours if _is_ours(name) or name in self.roles.values() else others)[topic.type] = topic.definition
        return message_types(list(ours.items()), str(self.path), list(others.items()))

    def _topic(self, topic: str) -> Topic:
        name = self.name_of(topic)
        if name in self.topics:
            return self.topics[name]
        raise RecordingError(f"{self.path}: no topic {name}, only {', '.join(sorted(self.topics))}")

    def _data(self, name: str) -> list[bytes]:
        return [message.data for message in self._messages[name]]

    def _log_times(self, name: str) -> NDArray[np.uint64]:
        return np.array([message.log_time for message in self._messages[name]], np.uint64)

    def _stamps_in(self, topic: str, messages: list[bytes]) -> NDArray[np.int64]:
        if any(len(message) < _STAMP_END for message in messages):
            raise RecordingError(f"{self.path}: topic {topic}: a message of less than {_STAMP_END} bytes")
        order = ">" if messages and messages[0].startswith(_BIG_ENDIAN) else "<"
        raw = b"".join(message[_STAMP_START:_STAMP_END] for message in messages)
        stamps = np.frombuffer(raw, np.dtype([("sec", f"{order}i4"), ("nanosec", f"{order}u4")]))
        return np.asarray(stamps["sec"].astype(np.int64) * 10**9 + stamps["nanosec"])

    @cached_property
    def _step_topics(self) -> frozenset[str]:
        return frozenset(name for role, name in self.roles.items() if role in TOPICS)

    @cached_property
    def _clock(self) -> tuple[NDArray[np.uint64], NDArray[np.int64]]:
        """Log times of all messages on step topics, ascending, and the latest stamp so far at each; ns, shapes (n,)."""
        steps = sorted(self._step_topics)
        received = np.concatenate([np.array([], np.uint64), *map(self._log_times, steps)])
        stamps = np.concatenate([np.array([], np.int64), *(self.times(topic) for topic in steps)])
        order = np.argsort(received, kind="stable")
        return received[order], np.maximum.accumulate(stamps[order].astype(np.int64))

    def _read(self) -> None:
        recorded_by = metadata.read_metadata(self.folder)
        counts = metadata.message_counts(recorded_by)
        for file in self.files:
            unpacker = Unpacker(file)
            scan = Scan(unpacker)
            found, orphans, attachments, rosbag2 = self._read_file(scan, unpacker)
            recorded_by = rosbag2 or recorded_by
            self.complete &= scan.closed
            self.loss.damages += [(file, *damage) for damage in scan.damages]
            statistics = scan.statistics
            stated = counts.get(file.name)
            expected = statistics.message_count if statistics else stated
            if stated not in (None, expected):
                self.contradictions.append(
                    f"metadata.yaml states {stated} messages in {file.name}, which has {expected}"
                )
            self.loss.counted &= expected is not None or not scan.damages
            # Messages of unknown topics are lost, too.
            self.loss.messages += max((scan.indexed if expected is None else expected) - found, orphans, 0)
            self.loss.attachments += max(statistics.attachment_count - attachments, 0) if statistics else 0
        for messages in self._messages.values():
            messages.sort(key=lambda message: message.log_time)  # an MCAP file need not be sorted
        self.loss.counted &= not self.loss.files
        self.custom_data = self.custom_data or metadata.custom_data(recorded_by)
        self.distro = str(recorded_by.get("ros_distro") or DISTRO)
        self.roles = roles({name: topic.type for name, topic in self.topics.items()}, self.custom_data, str(self.path))
        self.namespace = namespace_of(self.roles)
        for topics in (self.topics, self.undecodable):
            topics.update((name, replace(topic, count=len(self._messages[name]))) for name, topic in topics.items())

    def _read_file(self, scan: Scan, unpacker: Unpacker) -> tuple[int, int, int, dict[str, Any]]:
        """Add the contents of the file in ``scan`` to the bag.

        Returns:
            Numbers of messages read, of messages of unknown topics, and of attachments; and the metadata of rosbag2.
        """
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        messages: list[Message] = []
        attachments = 0
        rosbag2: dict[str, Any] = {}
        for record in scan.records():
            match record:
                case Message():
                    messages.append(record)
                case Schema():
                    schemas.setdefault(record.id, record)  # the first one is protected by the checksum of its chunk
                case Channel():
                    channels.setdefault(record.id, record)
                case Attachment():
                    attachments += 1
                    self.attachments[record.name] = record.data
                    self.media_types[record.name] = record.media_type
                case Metadata() if record.name == metadata.CUSTOM_DATA:
                    self.custom_data |= record.metadata
                case Metadata() if record.name == metadata.ROSBAG2:
                    rosbag2 = metadata.parsed(record.metadata.get(metadata.SERIALIZED, "")) or rosbag2
        for channel in list(channels.values()):
            try:
                self._declare(channel, schemas.get(channel.schema_id))
            except RecordingError:
                if not scan.damages:
                    raise
                del channels[channel.id]  # its definition is lost or damaged
        read = orphans = 0
        for message in messages:
            if message.channel_id not in channels:  # the channel is lost
                orphans += 1
            elif (data := unpacker.message(message.data)) is not None:
                read += 1
                message.data = data
                self._messages[channels[message.channel_id].topic].append(message)
        return read, orphans, attachments, rosbag2

    def _declare(self, channel: Channel, schema: Schema | None) -> None:
        """Add the topic of a channel."""
        name = channel.topic
        decodable = schema is not None and (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
        if not decodable and _is_ours(name):
            raise RecordingError(f"{self.path}: topic {name}: expected a ROS 2 message in CDR")
        if schema is None:
            return
        if schema.name != (expected := _USUAL.get(name, schema.name)):
            raise RecordingError(f"{self.path}: topic {name} is {schema.name}, expected {expected}")
        text = schema.data.decode("utf-8-sig" if decodable else "utf-8", errors="surrogateescape")
        latched = name == ROSOUT or schema.name in LATCHED_TOPICS.values()
        topic = Topic(
            name,
            schema.name,
            text.replace("\r\n", "\n") if decodable else text,
            channel.metadata.get("topic_type_hash", ""),
            recorded_qos(channel.metadata.get("offered_qos_profiles", ""), latched=latched),
            schema_encoding=schema.encoding,
            encoding=channel.message_encoding,
        )
        first = (self.topics if decodable else self.undecodable).setdefault(name, topic)
        if (topic.type, topic.definition) != (first.type, first.definition):
            raise RecordingError(f"{self.path}: topic {name}: recorded with two definitions, expected one")

    def _check(self) -> None:
        if not self.topics and self.loss.damages:
            file, offset, what = self.loss.damages[0]
            if not offset:
                raise RecordingError(f"{file}: is not an MCAP file")
            raise RecordingError(f"{file}: is damaged, and nothing of it can be read ({what} at byte {offset})")
        if not self.topics and not self.complete:
            raise RecordingError(f"{self.path}: is truncated before its first messages")
        if RUN in self.roles and (found := self.constants(RUN).get("INTERFACE_VERSION", 1)) != INTERFACE_VERSION:
            raise RecordingError(
                f"{self.path}: interface version {found}, recorded by commit "
                f"{self.custom_data.get('commit', 'unknown')}: expected version {INTERFACE_VERSION}"
            )
        if not any(_OURS in topic for topic in (*self.topics, *map(resolved, self.roles))):
            raise RecordingError(f"{self.path}: has no topic below {_OURS}, expected a bag of this project")


def _is_ours(topic: str) -> bool:
    return topic in _USUAL or _OURS in topic
