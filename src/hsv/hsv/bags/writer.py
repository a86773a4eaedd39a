"""Writing a bag: an MCAP file with the layout of rosbag2 (ROS 2 Jazzy) and, at the end, its metadata.yaml."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from mcap.writer import CompressionType, Writer

from hsv.bags.files import locked
from hsv.bags.metadata import (
    CUSTOM_DATA,
    ROSBAG2,
    Tally,
    TopicInformation,
    information,
    record,
    write_metadata,
)
from hsv.bags.topic import Topic
from hsv.base.errors import RecordingError

CHUNK_BYTES = 16 * 1024
"""Uncompressed size of a chunk: some seven steps of the loop, all that is lost when the writer is killed."""
_RECORD_OVERHEAD = 31
"""Bytes of an MCAP message record around its data."""


def mcap_path(directory: Path) -> Path:
    """Return the MCAP file of a bag directory, named as rosbag2 names the first file."""
    return directory / f"{directory.name}_0.mcap"


class BagWriter:
    """Writes one bag directory.

    Every finished chunk is handed to the operating system at once, so that a killed process loses the chunk in
    progress and nothing else; :func:`hsv.bags.recover.recover` then makes a proper bag of the rest. Until then
    the file is locked, so that nobody takes it for one whose writer was killed.

    Args:
        directory: The bag directory, ``<name>/`` with ``<name>_0.mcap``; new, or empty.
        topics: The topics known from the start.
        custom_data: What is known of the run before it starts (run id, seed, commit, design hash); kept by a killed run
            too.

    Raises:
        RecordingError: If the directory holds something already or cannot be made.
    """

    def __init__(
        self, directory: Path | str, topics: Iterable[Topic] = (), custom_data: Mapping[str, str] | None = None
    ) -> None:
        self.directory = Path(directory).absolute()
        self.path = mcap_path(self.directory)
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
        # Chunks are ended by flush() here, because the writer's own limit leaves them in the buffer of the stream.
        self._writer = Writer(self._stream, chunk_size=2**31, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2")
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels: dict[str, int] = {}
        self._topics: dict[str, Topic] = {}
        self._tallies: dict[str, Tally] = {}
        self._custom_data: dict[str, str] = {}
        self._pending = 0
        self.add_custom_data(custom_data or {})
        for topic in topics:
            self.add_topic(topic)

    def add_topic(self, topic: Topic) -> None:
        """Add a topic; also in flight, before its first message.

        Raises:
            RecordingError: If the bag has a topic of this name.
        """
        if topic.name in self._channels:
            raise RecordingError(f"topic {topic.name}: is in the bag already, expected a new name")
        key = (topic.type, topic.definition)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(topic.type, "ros2msg", topic.definition.encode())
        self._channels[topic.name] = self._writer.register_channel(
            topic.name,
            "cdr",
            self._schemas[key],
            {"offered_qos_profiles": topic.qos.as_yaml(), "topic_type_hash": topic.type_hash},
        )
        self._topics[topic.name] = topic
        self._tallies[topic.name] = Tally()

    def __contains__(self, topic: str) -> bool:
        """Whether messages of this topic can be written."""
        return topic in self._channels

    def write(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write one message.

        Args:
            topic: Name of an added topic.
            time_ns: Simulated time in nanoseconds, kept as log time and as publish time.
            data: The message in CDR with its header of four bytes.

        Raises:
            RecordingError: If the topic was not added or the file cannot be written (no space left).
        """
        try:
            channel = self._channels[topic]
        except KeyError:
            raise RecordingError(f"topic {topic}: not in the bag, expected one that was added before") from None
        self._writer.add_message(channel, time_ns, data, time_ns)
        self._tallies[topic].add(time_ns)
        self._pending += len(data) + _RECORD_OVERHEAD
        if self._pending >= CHUNK_BYTES:
            self.flush()

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add an attachment. It is on disk at once: attach before the first message, so that a killed run has it."""
        with self._writing():
            self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
            self._stream.flush()

    def flush(self) -> None:
        """End the current chunk and hand it to the operating system: its data survive the end of this process."""
        with self._writing():
            self._writer.flush()
        self._pending = 0

    def close(self, custom_data: Mapping[str, str] | None = None) -> None:
        """Finish the file and write metadata.yaml.

        Args:
            custom_data: What is known only at the end (outcome, wall time); added to that given at the start.
        """
        self.add_custom_data(custom_data or {})
        topics = [
            TopicInformation(name, topic.type, topic.qos.as_yaml(), topic.type_hash, self._tallies[name].count)
            for name, topic in self._topics.items()
        ]
        values = information(self.path.name, Tally.of(self._tallies.values()), topics, self._custom_data)
        with self._writing():
            self._writer.add_metadata(ROSBAG2, record(values))
            self._writer.finish()
            self._stream.close()
            write_metadata(self.directory, values)

    def add_custom_data(self, custom_data: Mapping[str, str]) -> None:
        """Add to the metadata of the run, replacing earlier values."""
        if custom_data:
            self._custom_data |= custom_data
            with self._writing():
                self._writer.add_metadata(CUSTOM_DATA, dict(custom_data))
                self._stream.flush()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be written: {error.strerror}") from None
