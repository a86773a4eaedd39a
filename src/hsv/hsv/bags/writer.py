"""Write a bag: an MCAP file with the layout of rosbag2 (ROS 2 Jazzy) and, at the end, its metadata.yaml."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import yaml
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2.metadata import dump_qos_v9

from hsv.bags import metadata
from hsv.bags.files import locked
from hsv.bags.metadata import DISTRO, Topic
from hsv.base.errors import RecordingError

CHUNK_BYTES = 16 * 1024
"""Uncompressed size of a chunk, bytes: about seven steps of the loop, which are lost if the writer is killed."""
_RECORD_OVERHEAD = 31
"""Size of an MCAP message record without its data, bytes."""

Schemas = dict[tuple[str, str, str], int]
"""Ids of the registered schemas by type, encoding and definition."""


def register(writer: Writer, topic: Topic, schemas: Schemas) -> int:
    """Register a topic with an MCAP writer, and its definition unless it is in ``schemas``; return the channel id."""
    key = topic.type, topic.schema_encoding, topic.definition
    if key not in schemas:
        schemas[key] = writer.register_schema(*key[:2], topic.definition.encode(errors="surrogateescape"))
    details = {
        "offered_qos_profiles": yaml.safe_dump(dump_qos_v9([topic.qos]), sort_keys=False),
        "topic_type_hash": topic.type_hash,
    }
    return writer.register_channel(topic.name, topic.encoding, schemas[key], details)


class BagWriter:
    """The writer of one bag directory.

    Every finished chunk is passed to the operating system at once, so that a killed process loses only the current
    chunk; :func:`hsv.bags.recover.recover` completes such a bag. The file is locked while the writer is open, which
    distinguishes it from a truncated one.

    Args:
        directory: The bag directory, ``<name>/`` with ``<name>_0.mcap``; new or empty.
        topics: The topics known at the start.
        custom_data: Data of the run known at the start, such as seed, commit and design hash.
        distro: ROS 2 distribution of the recorder.

    Raises:
        RecordingError: The directory is not empty or cannot be created.
    """

    def __init__(
        self,
        directory: Path | str,
        topics: Iterable[Topic] = (),
        custom_data: Mapping[str, str] | None = None,
        distro: str = DISTRO,
    ) -> None:
        self.directory = Path(directory).absolute()
        self.path = self.directory / f"{self.directory.name}_0.mcap"  # as rosbag2 names the first file
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            if any(self.directory.iterdir()):
                raise FileExistsError
            self._stream = self.path.open("xb")
        except FileExistsError:
            raise RecordingError(f"bag directory {directory}: exists already, expected a new one") from None
        except OSError as error:
            raise RecordingError(f"bag directory {directory}: cannot be made: {error.strerror}") from None
        locked(self._stream)
        # Chunks are ended by flush() below: the limit of the library would leave them in the buffer of the stream.
        self._writer = Writer(self._stream, chunk_size=2**31, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2")
        self._schemas: Schemas = {}
        self._channels: dict[str, int] = {}
        self._topics: dict[str, Topic] = {}
        self._counts: dict[str, int] = {}
        self._span = metadata.EMPTY_SPAN
        self._distro = distro
        self._custom_data: dict[str, str] = {}
        self._pending = 0
        self.add_custom_data(custom_data or {})
        for topic in topics:
            self.add_topic(topic)

    def add_topic(self, topic: Topic) -> None:
        """Add a topic before its first message; refuse a name that the bag has."""
        if topic.name in self._channels:
            raise RecordingError(f"topic {topic.name}: is in the bag already, expected a new name")
        self._channels[topic.name] = register(self._writer, topic, self._schemas)
        self._topics[topic.name] = topic
        self._counts[topic.name] = 0

    def __contains__(self, topic: str) -> bool:
        return topic in self._channels

    def write(self, topic: str, time_ns: int, data: bytes, publish_time: int | None = None) -> None:
        """Write a message in CDR with the simulated time ``time_ns`` as log time, and by default also as publish time.

        Raises:
            RecordingError: The topic was not added, or a full chunk cannot be written, see :meth:`flush`.
        """
        if topic not in self._channels:
            raise RecordingError(f"topic {topic}: not in the bag, expected one that was added before")
        published = time_ns if publish_time is None else publish_time
        self._writer.add_message(self._channels[topic], time_ns, data, published)
        self._counts[topic] += 1
        self._span = min(self._span[0], time_ns), max(self._span[1], time_ns)
        self._pending += len(data) + _RECORD_OVERHEAD
        if self._pending >= CHUNK_BYTES:
            self.flush()

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add an attachment, which is written at once; attach before the first message, so that a killed run has it."""
        with self._writing():
            self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
            self._stream.flush()

    def flush(self) -> None:
        """End the current chunk and pass it to the operating system, so that it survives the end of this process.

        Raises:
            RecordingError: The file cannot be written, or has been moved, removed or replaced.
        """
        with self._writing():
            self._writer.flush()
            if not os.path.samestat(self.path.stat(), os.fstat(self._stream.fileno())):
                raise FileNotFoundError(errno.ENOENT, "it was replaced")
        self._pending = 0

    def close(self, custom_data: Mapping[str, str] | None = None) -> None:
        """Finish the file and write metadata.yaml; ``custom_data`` known only at the end are added."""
        self.add_custom_data(custom_data or {})
        topics = [replace(topic, count=self._counts[name]) for name, topic in self._topics.items()]
        values = metadata.information(self.path.name, topics, self._span, self._custom_data, self._distro)
        with self._writing():
            self._writer.add_metadata(metadata.ROSBAG2, {metadata.SERIALIZED: metadata.as_yaml(values)})
            self._writer.finish()
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self._stream.close()
            metadata.write_metadata(self.directory, values)

    def add_custom_data(self, custom_data: Mapping[str, str]) -> None:
        """Add custom data of the run, replacing earlier values."""
        if custom_data:
            self._custom_data |= custom_data
            with self._writing():
                self._writer.add_metadata(metadata.CUSTOM_DATA, dict(custom_data))
                self._stream.flush()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be written: {error.strerror}") from error
