"""Scan of the records of an MCAP file that continues after damages.

The readers of the ``mcap`` package end at the first damage. This scan continues with the next chunk, attachment or end
of data. The package parses the records.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import takewhile
from typing import Any

from mcap import records as kinds
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from hsv.bags.files import COMPRESSIONS, Unpacker

_FRAME = struct.Struct("<BQ")
"""Opcode and length at the start of a record."""
_MESSAGE = struct.Struct("<HIQQ")
"""Channel id, sequence, log time and publish time at the start of a message record; the data follow."""
_CHECKSUM = 4
_INDEX_HEADER, _INDEX_ENTRY = 6, 16
"""Sizes of the beginning of a message index, and of its entry for a message, bytes."""

# The start of a chunk, an attachment or an end of data with a length below 2^40.
_CANDIDATE = re.compile(rb"(?=[\x06\x09\x0f].{5}\x00{3})", re.DOTALL)

_DAMAGE = (EndOfFile, struct.error, UnicodeDecodeError, OverflowError, MemoryError)
"""Exceptions of the package for records whose lengths or texts are wrong."""

_KINDS: dict[int, Any] = {
    Opcode.HEADER: kinds.Header,
    Opcode.FOOTER: kinds.Footer,
    Opcode.SCHEMA: kinds.Schema,
    Opcode.CHANNEL: kinds.Channel,
    Opcode.CHUNK: kinds.Chunk,
    Opcode.CHUNK_INDEX: kinds.ChunkIndex,
    Opcode.ATTACHMENT: kinds.Attachment,
    Opcode.ATTACHMENT_INDEX: kinds.AttachmentIndex,
    Opcode.STATISTICS: kinds.Statistics,
    Opcode.METADATA: kinds.Metadata,
    Opcode.METADATA_INDEX: kinds.MetadataIndex,
    Opcode.SUMMARY_OFFSET: kinds.SummaryOffset,
    Opcode.DATA_END: kinds.DataEnd,
}

Found = tuple[int, kinds.McapRecord | None, int]
"""Start, record and end; the record is None for a message index or a private kind."""


@dataclass(frozen=True)
class Damage:
    """A damaged part of a file; ``offset`` is its first byte."""

    offset: int
    what: str

    def __str__(self) -> str:
        return f"{self.what} at byte {self.offset}"


class Scan:
    """A scan of the records of a file; the attributes are complete after :meth:`records` is exhausted.

    Args:
        file: The file, with what unpacks its chunks.
    """

    def __init__(self, file: Unpacker) -> None:
        self.damages: list[Damage] = []
        """Damages before the last intact record."""
        self.closed = False
        """Whether the file has a footer, which the writer adds at its end."""
        self.statistics: kinds.Statistics | None = None
        """Statistics of the writer, if the summary is intact."""
        self.indexed = 0
        """Number of messages in the indexes of the chunks."""
        self._file = file
        self._data = memoryview(file.data)

    @property
    def is_mcap(self) -> bool:
        """Whether the data are an MCAP file: they begin like one, or contain a record after a damaged beginning."""
        magic = MCAP0_MAGIC
        return self._data[: len(magic)] == magic[: len(self._data)] or self._next(0) is not None

    def records(self) -> Iterator[kinds.McapRecord]:
        """Yield every intact record of the data section; chunks are replaced by their records.

        Data with a wrong checksum, or without a valid record, are skipped and added to :attr:`damages`. A record cut
        off at the end of the file, as left by a killed writer, is skipped as well.
        """
        data, chunks = self._data, set[int]()
        position: int | None = len(MCAP0_MAGIC)
        if data[:position] != MCAP0_MAGIC:
            self.damages.append(Damage(0, "the beginning"))
        summary, counted, new = 0, None, True
        while position is not None:
            for start, record, end in _walk(data, position):
                position = end
                match record:
                    case kinds.Chunk():
                        new = (digest := hash(record.data)) not in chunks  # a doubled chunk is read once
                        chunks.add(digest)
                        found, what = self._unpacked(record) if new else ([], "")
                        yield from found
                        if what:
                            self.damages.append(Damage(start, what))
                            following = self._next(start + 1)  # an intact chunk may begin inside a damaged one
                            if following is not None and following < end:
                                position = following
                                break
                    case None if data[start] == Opcode.MESSAGE_INDEX:
                        self.indexed += new * ((end - start - _FRAME.size - _INDEX_HEADER) // _INDEX_ENTRY)
                    case kinds.Attachment() if not _fits_checksum(data[start + _FRAME.size : end]):
                        self.damages.append(Damage(start, "an attachment"))
                    case kinds.DataEnd():
                        summary = end
                    case kinds.Statistics():
                        counted = record
                    case kinds.Footer():
                        self.closed = True
                        if not summary or _fits_checksum(data[summary:end]):
                            self.statistics = counted
                        else:
                            self.damages.append(Damage(summary, "the summary"))
                        return
                    case kinds.McapRecord():
                        yield record
            else:
                damaged, position = position, self._next(position + 1)
                if position is not None:
                    self.damages.append(Damage(damaged, "what lies"))

    def _next(self, position: int) -> int | None:
        """Return the start of the next intact chunk, attachment or end of data, or None."""
        candidates = (match.start() for match in _CANDIDATE.finditer(self._data, position))
        return next((at for at in candidates if next(_walk(self._data, at), None)), None)

    def _unpacked(self, chunk: kinds.Chunk) -> tuple[list[kinds.McapRecord], str]:
        """Return the records of a chunk and a description of its damage, empty without one.

        The records are all or none, or those before the first damage in a chunk without a checksum.
        """
        if chunk.compression not in ("", *COMPRESSIONS.values()):
            return [], f"a chunk (unsupported compression type {chunk.compression}, expected zstd, lz4 or none)"
        data, whole = self._file.unpacked(chunk.data, chunk.compression)
        if not whole or chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            return [], "a chunk"
        known = kinds.Message | kinds.Channel | kinds.Schema
        found = list(takewhile(lambda found: isinstance(found[1], known), _walk(memoryview(data), 0)))
        end = found[-1][2] if found else 0
        return [record for _, record, _ in found if record], "part of a chunk" if end < len(data) else ""


def _walk(data: memoryview, position: int) -> Iterator[Found]:
    """Yield the consistent records from ``position`` on: known kinds are filled exactly by their fields."""
    while position + _FRAME.size <= len(data):
        opcode, length = _FRAME.unpack_from(data, position)
        start, end = position + _FRAME.size, position + _FRAME.size + length
        if not opcode or end > len(data):
            return
        record = None
        if opcode in _KINDS:
            stream = ReadDataStream(BytesIO(data[start:end]))
            try:
                record = _KINDS[opcode].read(stream)
            except _DAMAGE:
                return
            if stream.count != length:
                return
        elif not _may_begin(data, end):
            return
        elif opcode == Opcode.MESSAGE:
            if length < _MESSAGE.size:
                return
            channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, start)
            record = kinds.Message(channel, log_time, bytes(data[start + _MESSAGE.size : end]), publish_time, sequence)
        yield position, record, end
        position = end


def _may_begin(data: memoryview, position: int) -> bool:
    """Return whether a record, or the end of the data, is possible at ``position``."""
    if position + _FRAME.size > len(data):
        return True
    opcode, length = _FRAME.unpack_from(data, position)
    return bool(opcode and position + _FRAME.size + length <= len(data))


def _fits_checksum(data: memoryview) -> bool:
    """Return whether ``data`` fit the checksum at their end; zero means no checksum."""
    expected = int.from_bytes(data[-_CHECKSUM:], "little")
    return expected in (0, zlib.crc32(data[:-_CHECKSUM]))
