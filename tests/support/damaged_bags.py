"""Bags damaged at random: bits flipped, blocks zeroed, cut, doubled; and what must be found in them all the same."""

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
"""Topic and data of every message."""

_FRAME = 9
"""Bytes of opcode and length before the content of a record."""


@dataclass(frozen=True)
class Original:
    """A whole bag: its bytes, those of every chunk, and the messages in each."""

    folder: Path
    data: bytes
    chunks: dict[bytes, Messages]
    attachments: dict[str, bytes]

    @cached_property
    def messages(self):
        return _together(self.chunks.values())

    def whole(self, damaged):
        """Return the messages of all chunks that stand in ``damaged`` as they were written."""
        return _together(messages for chunk, messages in self.chunks.items() if chunk in damaged)

    def defines(self, damaged):
        """Return whether the definitions are whole somewhere: in the first chunk, or after the last."""
        chunks = list(self.chunks)
        end = self.data.index(chunks[-1]) + len(chunks[-1])
        return chunks[0] in damaged or self.data[end:] in damaged


def _together(parts):
    return Counter(chain.from_iterable(part.elements() for part in parts))


def original(folder):
    """Read a whole bag with the package's own readers."""
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
    """Write the bag, damaged, to the directory ``target``; return what was done and the bytes that are left."""
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
    """Return the messages that ``bag``, a :class:`hsv.bags.reader.Bag`, has found."""
    return Counter((topic, data) for topic in bag.topics for _, data in bag.messages(topic))
