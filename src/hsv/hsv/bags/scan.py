"""Scan of an MCAP file that goes on after damaged data, where the readers of the ``mcap`` package stop."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO

from mcap import records as kinds
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from hsv.bags.files import COMPRESSIONS, Unpacker
from hsv.base.errors import RecordingError

_FRAME = struct.Struct("<BQ")
"""Opcode and length at the start of a record."""
_MESSAGE = struct.Struct("<HIQQ")
"""Channel, sequence number, log time and publish time at the start of a message."""
_CANDIDATE = re.compile(rb"(?=[\x06\x09\x0f].{5}\x00{3})", re.DOTALL)
"""Possible start of a chunk, of an attachment, or of the end of the data."""
# Exceptions of the mcap package for wrong lengths and texts.
_DAMAGE = (EndOfFile, struct.error, UnicodeDecodeError, OverflowError, MemoryError)
MAX_RECORD = 2**28
"""Maximum length (bytes) of a record; our recorder writes chunks of some kilobytes and attachments of some megabytes"""
MAX_GAP = 2**26
"""Maximum length (bytes) of damage between two records; what follows more is no part of the bag"""
_KINDS = {opcode: getattr(kinds, opcode.name.title().replace("_", "")) for opcode in Opcode}


class Scan:
    """A scan of the records of a file; the attributes are complete after :meth:`records` is exhausted."""

    def __init__(self, file: Unpacker) -> None:
        self.damages: list[tuple[int, str]] = []
        """Offset and description of each damage before the last intact record."""
        self.closed = False
        """Whether the file has a footer, which the writer adds at its end."""
        self.statistics: kinds.Statistics | None = None
        """Statistics of the writer, if the summary is intact."""
        self.indexed = 0
        """Number of messages in the indexes of the chunks."""
        self._file = file
        self._data = memoryview(file.data)

    def records(self) -> Iterator[kinds.McapRecord]:
        """Yield the intact records, and instead of a chunk its records; list damaged data in ``damages`` and go on.

        Message indexes, statistics, the record that ends the data, and the footer are evaluated, not yielded. A chunk
        that repeats another, and a record cut off at the file's end by a killed writer, are skipped and not listed.
        """
        data, position, chunks = self._data, len(MCAP0_MAGIC), set[int]()
        if not MCAP0_MAGIC.startswith(bytes(data[:position])):
            self.damages.append((0, "the beginning"))
        summary, counted, new = 0, None, True
        while position < len(data):
            record, end = _record(data, position)
            if not end and (end := self._next(position + 1)) < len(data):
                self.damages.append((position, "what lies"))
            match record:
                case kinds.Chunk():
                    new = (digest := hash(record.data)) not in chunks  # a doubled chunk is read once
                    chunks.add(digest)
                    found, what = self._unpacked(record) if new else ([], "")
                    yield from found
                    if what:
                        self.damages.append((position, what))
                        end = min(end, self._next(position + 1))  # an intact chunk may begin inside
                case kinds.MessageIndex():
                    self.indexed += new * len(record.records)
                case kinds.Attachment() if not _fits_checksum(data[position + _FRAME.size : end]):
                    self.damages.append((position, "an attachment"))
                case kinds.DataEnd():
                    summary = end
                case kinds.Statistics():
                    counted = record
                case kinds.Footer():
                    self.closed = True
                    if not summary or _fits_checksum(data[summary:end]):
                        self.statistics = counted
                    else:
                        self.damages.append((summary, "the summary"))
                    return
                case kinds.McapRecord():
                    yield record
            position = end

    def _next(self, position: int) -> int:
        """Return the offset, from ``position`` on, of the next intact chunk, attachment or data end, or file size."""
        end = min(len(self._data), position + MAX_GAP)
        candidates = (match.start() for match in _CANDIDATE.finditer(self._data, position, end))
        found = next((at for at in candidates if _record(self._data, at)[1]), end)
        if found == end < len(self._data):
            raise RecordingError(f"{self._file.path}: no record in the {MAX_GAP} bytes from byte {position} on")
        return found

    def _unpacked(self, chunk: kinds.Chunk) -> tuple[list[kinds.McapRecord], str]:
        """Return the records of a chunk, and a description of its damage, empty if it is intact.

        There are no records if decompression fails or the checksum is wrong; after other damage, those before it.
        """
        if chunk.compression not in ("", *COMPRESSIONS.values()):
            return [], f"a chunk (unsupported compression type {chunk.compression}, expected zstd, lz4 or none)"
        data, whole = self._file.unpacked(chunk.data, chunk.compression)
        whole = whole and chunk.uncompressed_crc in (0, zlib.crc32(data))
        found, position = list[kinds.McapRecord](), 0
        while whole and position < len(data):
            record, position = _record(memoryview(data), position)
            whole = position > 0 and isinstance(record, kinds.Message | kinds.Channel | kinds.Schema | None)
            found += [record] if record and whole else []
        return found, "" if whole else "a chunk"


def _record(data: memoryview, position: int) -> tuple[kinds.McapRecord | None, int]:
    """Return the record at ``position`` and its end's offset: (None, end) if of private kind, (None, 0) if damaged."""
    start = position + _FRAME.size
    opcode, length = _FRAME.unpack_from(data, position) if start <= len(data) else (0, 0)
    end = start + length
    if end > len(data) or length > MAX_RECORD or opcode not in _KINDS:
        return None, end if opcode >= 0x80 and end <= len(data) else 0  # opcodes from 0x80 on are private
    if opcode == Opcode.MESSAGE:  # nearly all records: the package would read each field of them by a function call
        if length < _MESSAGE.size:
            return None, 0
        channel, sequence, logged, published = _MESSAGE.unpack_from(data, start)
        return kinds.Message(channel, logged, bytes(data[start + _MESSAGE.size : end]), published, sequence), end
    stream = ReadDataStream(BytesIO(data[start:end]))
    try:
        record = _KINDS[opcode].read(stream)
    except _DAMAGE:
        return None, 0
    return (record, end) if stream.count == length else (None, 0)


def _fits_checksum(data: memoryview) -> bool:
    """Return whether the CRC-32 in the last four bytes of ``data`` fits the rest, or is zero, which means none."""
    expected = int.from_bytes(data[-4:], "little")
    return expected in (0, zlib.crc32(data[:-4]))
