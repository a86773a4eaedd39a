"""Copies of bags as the tools of rosbag2 write them: recorded at wall time, split, compressed, converted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import yaml
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

WALL_TIME = 1_795_000_000 * 10**9
"""Nanoseconds since 1970 at which a recording begins."""

COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes,
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
}

Kept = Callable[[str, int], bool]
"""From topic and log time of the source to whether a message is recorded."""


def everything(topic: str, time: int) -> bool:
    return True


def wall_times(count: int) -> np.ndarray:
    """Return when so many messages of a flight are received: in their order, and unevenly."""
    return WALL_TIME + np.cumsum(np.random.default_rng(5).integers(1_000, 4_000_000, count))


def recorded(
    source: Path,
    target: Path,
    *,
    files: int = 1,
    mode: str = "",
    compression: str = "",
    chunks: CompressionType = CompressionType.NONE,
    kept: Kept = everything,
    wall: bool = True,
) -> Path:
    """Write ``source`` as ``ros2 bag record`` does: no attachments, no checksums, log time is the wall's.

    Args:
        source: A bag of one file.
        target: Bag directory to write.
        files: Number of files into which it is split.
        mode: ``file`` or ``message``: what is compressed.
        compression: ``zstd`` or ``lz4``.
        chunks: How MCAP itself compresses.
        kept: What is recorded; the rest is missed.
        wall: Whether log time is the wall's, else that of the source.
    """
    with Reader(source) as reader:
        found = [(c, time, bytes(data)) for c, time, data in reader.messages()]
        connections = list(reader.connections)
        texts = {t["topic_metadata"]["name"]: t for t in _information(source)["topics_with_message_count"]}
    received = wall_times(len(found)) if wall else [time for _, time, _ in found]
    missed = [kept(c.topic, time) for c, time, _ in found]
    target.mkdir()
    entries = []
    parts = np.array_split(np.arange(len(found)), files)
    for number, rows in enumerate(parts):
        path = target / f"{target.name}_{number}.mcap"
        count = 0
        with path.open("wb") as stream:
            writer = Writer(stream, chunk_size=300_000, compression=chunks, enable_crcs=False)
            writer.start(profile="ros2")
            channels = {}
            for c in connections:
                schema = writer.register_schema(c.msgtype, "ros2msg", c.msgdef.data.encode())
                qos = yaml.safe_dump(texts[c.topic]["topic_metadata"]["offered_qos_profiles"])
                metadata = {"offered_qos_profiles": qos, "topic_type_hash": c.digest}
                channels[c.topic] = writer.register_channel(c.topic, "cdr", schema, metadata)
            for row in rows:
                if missed[row]:
                    data = COMPRESS[compression if mode == "message" else ""](found[row][2])
                    writer.add_message(channels[found[row][0].topic], int(received[row]), data, int(received[row]))
                    count += 1
            writer.finish()
        if mode == "file":
            whole = path.read_bytes()
            path.unlink()
            path = path.with_name(f"{path.name}.{compression}")
            path.write_bytes(COMPRESS[compression](whole))
        span = (
            {"nanoseconds_since_epoch": int(received[rows[0]])},
            {"nanoseconds": int(received[rows[-1]] - received[rows[0]])},
        )
        entries.append({"path": path.name, "starting_time": span[0], "duration": span[1], "message_count": count})
    information = _information(source) | {
        "relative_file_paths": [entry["path"] for entry in entries],
        "files": entries,
        "message_count": sum(entry["message_count"] for entry in entries),
        "compression_mode": mode,
        "compression_format": compression,
    }
    (target / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": information}))
    return target


def converted(source: Path, target: Path, mode: CompressionMode = CompressionMode.NONE) -> Path:
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
                offered_qos_profiles=c.ext.offered_qos_profiles,  # type: ignore[union-attr]
            )
            for c in reader.connections
        }
        for connection, time, data in reader.messages():
            writer.write(made[connection.id], time, data)
    return target


def _information(bag: Path) -> dict:
    return yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
