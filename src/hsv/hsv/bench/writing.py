"""The bag writer against the MCAP library alone."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from mcap.writer import CompressionType, Writer

from hsv.bags.description import CLOCK, COMMAND, NOMINAL, STATE, TUBE_STATUS
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import BagWriter
from hsv.bench.figure import Figure, interleaved

_SIZES = {CLOCK: 12, STATE: 104, TUBE_STATUS: 400, NOMINAL: 240, COMMAND: 40}
"""Topics and bytes a message, about those of a step."""

_STEPS = 4000


def against_mcap(repeats: int) -> list[Figure]:
    """Return the time to write the messages of a flight, readable after a crash, against the library's defaults."""
    messages = {topic: bytes(range(256)) * (size // 256) + bytes(size % 256) for topic, size in _SIZES.items()}
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        numbers = iter(range(10**6))

        def ours() -> None:
            bag = BagWriter(Path(folder, f"bag_{next(numbers)}"))
            for topic in messages:
                bag.add_topic(Topic(topic, "std_msgs/msg/Empty", "", "", Qos(depth=1)))
            for step in range(_STEPS):
                for topic, data in messages.items():
                    bag.write(topic, step, data)
            bag.close()

        def theirs() -> None:
            with Path(folder, f"plain_{next(numbers)}.mcap").open("wb") as stream:
                writer = Writer(stream, compression=CompressionType.ZSTD)
                writer.start("ros2")
                schema = writer.register_schema("std_msgs/msg/Empty", "ros2msg", b"")
                channels = {topic: writer.register_channel(topic, "cdr", schema) for topic in messages}
                for step in range(_STEPS):
                    for topic, data in messages.items():
                        writer.add_message(channels[topic], step, data, step)
                writer.finish()

        times = interleaved(ours, theirs, repeats, time.process_time)
    rate = _STEPS * len(messages) / min(times[0])
    return [
        Figure(
            "mcap",
            f"bag of {_STEPS * len(messages)} messages, chunks of 16 KiB flushed, metadata",
            "mcap library, chunks of 1 MiB",
            "s",
            *times,
            note=f"{rate:.0f} messages a second",
        )
    ]
