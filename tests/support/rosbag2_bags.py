"""Copies of bags as the tools of rosbag2 write them: recorded at wall time, split, compressed, converted."""

from collections.abc import Callable, Sequence

import lz4.frame
import numpy as np
import yaml
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

WALL_TIME = 1_795_000_000 * 10**9
"""Nanoseconds since 1970 at which a recording begins."""

COMPRESS = {"": bytes, "zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress}

Stored = Callable[[list[tuple[str, int]]], Sequence[int]]
"""From topics and log times of the source to the rows that are recorded, in the order in which they are stored."""


def everything(messages):
    return range(len(messages))


def out_of_order(messages):
    return np.random.default_rng(6).permutation(len(messages)).tolist()


def wall_times(count, begin):
    """Return when so many messages of a flight are received from ``begin`` on: in their order, and unevenly."""
    passed = np.cumsum(np.random.default_rng(5).integers(1_000, 4_000_000, count))
    return np.uint64(begin) + passed.astype(np.uint64)


NUMBERS = {"keep_last": 1, "reliable": 1, "transient_local": 1, "volatile": 2, "automatic": 1}
"""Numbers that rosbag2 of Humble and Iron writes for the words of a quality of service."""


def numbered(profiles):
    """Return the profiles of a topic as Humble and Iron write them."""
    return [{key: NUMBERS.get(str(value), value) for key, value in profile.items()} for profile in profiles]


def recorded(
    source, target, *, files=1, compressed="", chunks=CompressionType.NONE, stored=everything, begin=WALL_TIME, qos=list
):
    """Write ``source`` as ``ros2 bag record`` does: no attachments, no checksums, log time is the wall's.

    Args:
        source: A bag of one file.
        target: Bag directory to write.
        files: Number of files into which it is split.
        compressed: What is compressed and how, such as ``file zstd`` or ``message lz4``.
        chunks: How MCAP itself compresses.
        stored: Which messages are stored, and in which order.
        begin: Log time of the wall at which the recording begins; None for the log times of the source.
        qos: Changes the profiles of a topic.
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
    """Convert a bag with the ``rosbags`` package, which keeps messages and nothing else."""
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
