"""Copies of bags in the form that rosbag2's tools write: recorded at wall time, split, compressed, converted."""

from collections.abc import Callable, Sequence

import lz4.frame
import numpy as np
import yaml
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

WALL_TIME = 1_795_000_000 * 10**9
"""Wall time at which a recording begins, nanoseconds since 1970."""

COMPRESS = {"": bytes, "zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress}

Stored = Callable[[list[tuple[str, int]]], Sequence[int]]
"""Maps (topic, log time) of all source messages to the indices of those that are stored, in their order."""


def everything(messages):
    return range(len(messages))


def out_of_order(messages):
    return np.random.default_rng(6).permutation(len(messages)).tolist()


def wall_times(count, begin):
    """Return ``count`` times (ns) at which messages are received from ``begin`` on: increasing and uneven."""
    passed = np.cumsum(np.random.default_rng(5).integers(1_000, 4_000_000, count))
    return np.uint64(begin) + passed.astype(np.uint64)


NUMBERS = {"keep_last": 1, "reliable": 1, "transient_local": 1, "volatile": 2, "automatic": 1}
"""The numbers that rosbag2 of Humble and Iron writes for the words of a QoS profile."""


def numbered(profiles):
    """Return the QoS profiles of a topic as Humble and Iron write them."""
    return [{key: NUMBERS.get(str(value), value) for key, value in profile.items()} for profile in profiles]


def recorded(
    source, target, *, files=1, compressed="", chunks=CompressionType.NONE, stored=everything, begin=WALL_TIME, qos=list
):
    """Write ``source`` as ``ros2 bag record`` does: no attachments, no checksums, wall time as log time.

    Args:
        source: A bag of one file.
        target: Bag directory to write.
        files: Number of files into which the copy is split.
        compressed: Mode and format of rosbag2's compression, such as ``file zstd`` or ``message lz4``.
        chunks: Compression of MCAP chunks.
        stored: Selects the stored messages and their order.
        begin: Wall time (ns) at which the recording begins; None keeps the log times of the source.
        qos: Function that changes the QoS profiles of a topic.
    """
    mode, _, compression = compressed.partition(" ")
    with Reader(source) as reader:
        found = [(c, time, bytes(data)) for c, time, data in reader.messages()]
        connections = list(reader.connections)
        texts = {t["topic_metadata"]["name"]: t for t in _information(source)["topics_with_message_count"]}
    received = [time for _, time, _ in found] if begin is None else wall_times(len(found), begin).tolist()
    target.mkdir()
    entries = []
    parts = np.array_split(stored([(c.topic, time) for c, time, _ in found]), files)
    for number, rows in enumerate(parts):
        path = target / f"{target.name}_{number}.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream, chunk_size=300_000, compression=chunks, enable_crcs=False)
            writer.start(profile="ros2")
            channels = {}
            for c in connections:
                schema = writer.register_schema(c.msgtype, "ros2msg", c.msgdef.data.encode())
                profiles = yaml.safe_dump(qos(texts[c.topic]["topic_metadata"]["offered_qos_profiles"]))
                metadata = {"offered_qos_profiles": profiles, "topic_type_hash": c.digest}
                channels[c.topic] = writer.register_channel(c.topic, "cdr", schema, metadata)
            for row in rows:
                data = COMPRESS[compression if mode == "message" else ""](found[row][2])
                writer.add_message(channels[found[row][0].topic], received[row], data, received[row])
            writer.finish()
        if mode == "file":
            whole = path.read_bytes()
            path.unlink()
            path = path.with_name(f"{path.name}.{compression}")
            path.write_bytes(COMPRESS[compression](whole))
        times = [received[row] for row in rows]
        span = {"nanoseconds_since_epoch": min(times)}, {"nanoseconds": max(times) - min(times)}
        entries.append({"path": path.name, "starting_time": span[0], "duration": span[1], "message_count": len(rows)})
    information = _information(source) | {
        "relative_file_paths": [entry["path"] for entry in entries],
        "files": entries,
        "message_count": sum(entry["message_count"] for entry in entries),
        "compression_mode": mode,
        "compression_format": compression,
    }
    (target / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": information}))
    return target


def converted(source, target, mode=CompressionMode.NONE):
    """Convert a bag with the ``rosbags`` package, which keeps only the messages."""
    writer = RosbagsWriter(target, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with Reader(source) as reader, writer:
        made = {
            c.id: writer.add_connection(
                c.topic,
                c.msgtype,
                msgdef=c.msgdef.data,
                rihs01=c.digest,
                offered_qos_profiles=c.ext.offered_qos_profiles,
            )
            for c in reader.connections
        }
        for connection, time, data in reader.messages():
            writer.write(made[connection.id], time, data)
    return target


def _information(bag):
    return yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
