"""Bags with random damage (flipped bits, zeroed, cut or doubled blocks), and the messages that must survive it."""

from __future__ import annotations

import shutil
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from itertools import chain
from pathlib import Path

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import breakup_chunk

Messages = Counter[tuple[str, bytes]]
"""How often each pair of topic and data occurs."""

_FRAME = 9
"""Bytes of opcode and length before the content of an MCAP record."""


@dataclass(frozen=True)
class Original:
    """An undamaged bag: its bytes, the bytes of every chunk, and the messages of each chunk."""

    folder: Path
    data: bytes
    chunks: dict[bytes, Messages]
    attachments: dict[str, bytes]

    @cached_property
    def messages(self):
        return _together(self.chunks.values())

    def whole(self, damaged):
        """Return the messages of all chunks that ``damaged`` still contains unchanged."""
        return _together(messages for chunk, messages in self.chunks.items() if chunk in damaged)

    def defines(self, damaged):
        """Return whether ``damaged`` has a complete set of definitions: in the first chunk, or after the last one."""
        chunks = list(self.chunks)
        end = self.data.index(chunks[-1]) + len(chunks[-1])
        return chunks[0] in damaged or self.data[end:] in damaged


def _together(parts):
    return Counter(chain.from_iterable(part.elements() for part in parts))


def original(folder):
    """Read an undamaged bag with the MCAP package's own readers."""
    data = next(folder.glob("*.mcap")).read_bytes()
    with next(folder.glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        chunks = {}
        for index in summary.chunk_indexes:
            stream.seek(index.chunk_start_offset)
            raw = stream.read(index.chunk_length)
            chunk = Chunk.read(ReadDataStream(BytesIO(raw[_FRAME:])))
            chunks[raw] = Counter(
                (summary.channels[record.channel_id].topic, record.data)
                for record in breakup_chunk(chunk, validate_crc=True)
                if isinstance(record, Message)
            )
    return Original(folder, data, chunks, attachments)


def damaged(source, target, seed):
    """Write a damaged copy of the bag to the directory ``target``; return the kind of damage and the damaged bytes."""
    random = np.random.default_rng(seed)
    data = bytearray(source.data)
    kind = ("bits flipped", "block zeroed", "cut", "block doubled", "two damages")[seed % 5]
    for one in ("bits flipped", "block zeroed") if kind == "two damages" else (kind,):
        position, size = int(random.integers(len(data))), int(random.choice([16, 512, 4096, 40_000]))
        match one:
            case "bits flipped":
                for at in random.integers(len(data), size=int(random.choice([1, 1, 3, 30]))):
                    data[at] ^= 1 << int(random.integers(8))
            case "block zeroed":
                data[position : position + size] = bytes(len(data[position : position + size]))
            case "cut":
                del data[position:]
            case "block doubled":
                data[position:position] = data[max(position - size, 0) : position]
    shutil.copytree(source.folder, target)
    file = next(target.glob("*.mcap"))
    file.write_bytes(data)
    if random.random() < 0.3:
        (target / "metadata.yaml").unlink()
    return f"{kind} (seed {seed})", bytes(data)


def found_in(bag):
    """Return the messages that a :class:`hsv.bags.reader.Bag` finds."""
    return Counter((topic, data) for topic in bag.topics for _, data in bag.messages(topic))
