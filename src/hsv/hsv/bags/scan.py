"""Scan of the records of an MCAP file that continues after damages.

The readers of the ``mcap`` package end at the first damage. This scan continues with the next chunk, attachment or end
of data. The package decodes the records, decompresses chunks and checks checksums.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from mcap import records as kinds
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from hsv.bags.files import COMPRESSIONS, Unpacker

_FRAME = struct.Struct("<BQ")
"""Opcode and length at the start of a record."""
MESSAGE_HEADER = struct.Struct("<HIQQ")
"""Channel id, sequence, log time and publish time at the start of a message record; the data follow."""
_INDEX_HEADER = struct.Struct("<HI")
_INDEX_ENTRY = 16
_CHECKSUM = struct.Struct("<I")

# The start of a chunk, an attachment or an end of data with a length below 2^40.
_CANDIDATE = re.compile(rb"(?=[\x06\x09\x0f].{5}\x00{3})", re.DOTALL)

_DAMAGE = (EndOfFile, struct.error, UnicodeDecodeError, OverflowError, MemoryError)
"""Exceptions of the package for records whose lengths or texts are wrong."""

_RECORDS = {
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
"""Record types that the package parses; a record is consistent if its fields fill it exactly."""


@dataclass(frozen=True)
class Damage:
    """A damaged part of a file."""

    offset: int
    """First byte."""
    length: int
    """Length in bytes."""
    what: str
    """Description of the damaged record."""

    def __str__(self) -> str:
        return f"{self.what} at byte {self.offset}"


def content(body: memoryview) -> ReadDataStream:
    """Return the body of a record as a stream for the ``read`` functions of ``mcap.records``."""
    return ReadDataStream(BytesIO(body))


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
        self._chunks: set[int] = set()
        """Digests of the chunks so far, so that a duplicated chunk is read once."""

    @property
    def is_mcap(self) -> bool:
        """Whether the data are an MCAP file: they begin like one, or contain a record after a damaged beginning."""
        magic = MCAP0_MAGIC
        return self._data[: len(magic)] == magic[: len(self._data)] or self._next(0) is not None

    def records(self) -> Iterator[tuple[int, memoryview]]:
        """Yield opcode and body of every intact record except indexes; chunks are replaced by their records.

        Data with a wrong checksum, or without a valid record, are skipped and added to :attr:`damages`. A record cut
        off at the end of the file, as left by a killed writer, is skipped as well.
        """
        position = len(MCAP0_MAGIC)
        if self._data[:position] != MCAP0_MAGIC:
            self.damages.append(Damage(0, position, "the beginning"))
        summary, counted, new = 0, None, True
        while position < len(self._data):
            end = self._end(position)
            if end is None:
                following = self._next(position + 1)
                if following is None:
                    return
                self.damages.append(Damage(position, following - position, "what lies"))
                position = following
                continue
            opcode, body = self._data[position], self._data[position + _FRAME.size : end]
            match opcode:
                case Opcode.CHUNK:
                    digest = hash(bytes(body))
                    new = digest not in self._chunks
                    self._chunks.add(digest)
                    damages = len(self.damages)
                    if new:
                        yield from self._unpacked(position, body)
                    if len(self.damages) > damages:  # an intact chunk may begin inside a damaged one
                        end = min(self._next(position + 1) or end, end)
                case Opcode.MESSAGE_INDEX:
                    self.indexed += new * ((len(body) - _INDEX_HEADER.size) // _INDEX_ENTRY)
                case Opcode.ATTACHMENT if not _fits_checksum(body, body):
                    self.damages.append(Damage(position, end - position, "an attachment"))
                case Opcode.DATA_END:
                    summary = end
                case Opcode.STATISTICS:
                    counted = kinds.Statistics.read(content(body))
                case Opcode.FOOTER:
                    self.closed = True
                    if not summary or _fits_checksum(self._data[summary:end], body):
                        self.statistics = counted
                    else:
                        self.damages.append(Damage(summary, position - summary, "the summary"))
                    return
                case _:
                    yield opcode, body
            position = end

    def _end(self, position: int) -> int | None:
        """Return the end of the record at ``position``; None if there is no consistent record."""
        if not self._may_begin(position) or position + _FRAME.size > len(self._data):
            return None
        opcode, length = _FRAME.unpack_from(self._data, position)
        start = position + _FRAME.size
        body = self._data[start : start + length]
        match opcode:
            case Opcode.MESSAGE:
                fits = length >= MESSAGE_HEADER.size and self._may_begin(start + length)
            case _ if opcode > Opcode.DATA_END:  # a private record, to be skipped
                fits = self._may_begin(start + length)
            case Opcode.MESSAGE_INDEX:
                entries = length - _INDEX_HEADER.size
                fits = entries >= 0 and _INDEX_HEADER.unpack_from(body)[1] == entries and entries % _INDEX_ENTRY == 0
            case _:
                fits = _is_filled(_RECORDS[Opcode(opcode)], body)
        return start + int(length) if fits else None

    def _may_begin(self, position: int) -> bool:
        """Return whether a record, or the end of the file, is possible at ``position``."""
        if position + _FRAME.size > len(self._data):
            return True
        opcode, length = _FRAME.unpack_from(self._data, position)
        return bool(opcode and position + _FRAME.size + length <= len(self._data))

    def _next(self, position: int) -> int | None:
        """Return the start of the next intact chunk, attachment or end of data, or None."""
        candidates = (match.start() for match in _CANDIDATE.finditer(self._data, position))
        return next((at for at in candidates if self._end(at) is not None), None)

    def _unpacked(self, offset: int, body: memoryview) -> Iterator[tuple[int, memoryview]]:
        """Yield the records of a chunk: all or none, or up to the first damage in a chunk without a checksum."""
        try:
            chunk = kinds.Chunk.read(content(body))
        except _DAMAGE:
            self.damages.append(Damage(offset, len(body), "a chunk"))
            return
        if (compression := chunk.compression) not in ("", *COMPRESSIONS.values()):
            problem = f"a chunk (unsupported compression type {compression}, expected zstd, lz4 or none)"
            self.damages.append(Damage(offset, len(body), problem))
            return
        unpacked, whole = self._file.unpacked(chunk.data, compression)
        if not whole or chunk.uncompressed_crc not in (0, zlib.crc32(unpacked)):
            self.damages.append(Damage(offset, len(body), "a chunk"))
            return
        data = memoryview(unpacked)
        found, position, head = [], 0, _FRAME.size
        while position + head <= len(data):
            opcode, length = _FRAME.unpack_from(data, position)
            end = position + head + length
            if end > len(data) or opcode not in (Opcode.MESSAGE, Opcode.CHANNEL, Opcode.SCHEMA):
                break
            found.append((opcode, data[position + head : end]))
            position = end
        if position < len(data):
            self.damages.append(Damage(offset, len(body), "part of a chunk"))
            found = found[:-1]  # the last one may be damaged
        yield from found


def _is_filled(kind: Any, body: memoryview) -> bool:
    stream = content(body)
    try:
        kind.read(stream)
    except _DAMAGE:
        return False
    return bool(stream.count == len(body))


def _fits_checksum(data: memoryview, record: memoryview) -> bool:
    """Return whether ``data`` fits the checksum at the end of ``record``; zero means no checksum."""
    (expected,) = _CHECKSUM.unpack(record[-_CHECKSUM.size :])
    return expected in (0, zlib.crc32(data[: -_CHECKSUM.size]))
