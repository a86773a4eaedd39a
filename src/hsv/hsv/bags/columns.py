"""Decoding all messages of a topic at once, into one array per field.

Names of the columns are field paths such as ``header.stamp``. Times and durations become int64 nanoseconds; numbers
arrays of shape (n,); arrays and sequences of numbers (n, length) or, where the lengths differ, objects; text and
lists of messages objects, the latter lists of dictionaries.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces.typing import Typesdict

from hsv.bags.fields import Field, as_dict, fields_of, nanoseconds
from hsv.base.errors import RecordingError

_LITTLE_ENDIAN = b"\x00\x01"
_HEADER = 4
_TAIL = 3
"""Bytes by which a message may be padded at its end."""
_EMPTY_SEQUENCE_TAIL = 4
"""rmw_fastrtps reserves room as if empty sequences were aligned like full ones, and serialize_message hands the
surplus on; what is received over DDS does not have it."""


class Columns(dict[str, NDArray[Any]]):
    """One array per field, by field path; reading a field that the definition does not have is a RecordingError."""

    def __init__(self, source: str = "") -> None:
        super().__init__()
        self.source = source
        """Source of the messages, for error messages."""

    def rows(self, rows: NDArray[np.intp]) -> Columns:
        """Return these rows of every column."""
        chosen = Columns(self.source)
        chosen.update((name, column[rows]) for name, column in self.items())
        return chosen

    def __missing__(self, name: str) -> NDArray[Any]:
        raise RecordingError(f"{self.source}: recorded with another definition, expected a field {name}")


class NoCommonLayoutError(Exception):
    """The messages do not all have their fields in the same places."""


def columns_at_once(types: Typesdict, message_type: str, messages: Sequence[bytes], source: str = "") -> Columns:
    """Decode messages of one common layout, in milliseconds for ten thousand.

    XCDR1 aligns every number to its own size, counted from the end of the four-byte header, so that the layout depends
    on nothing but the lengths of text and sequences. It is found by walking the definition along the first message;
    all messages that are as long and hold the same lengths in the same places have it too.

    Args:
        types: The definitions of the type and of those it depends on.
        message_type: ``package/msg/Type``.
        messages: At least one message in CDR with its header.
        source: Where the messages come from, for errors.

    Raises:
        NoCommonLayoutError: If the messages differ in layout, or have text or messages in a sequence: see
            :func:`columns_one_by_one`.
    """
    size = len(messages[0])
    raw = b"".join(messages)
    if any(len(message) != size for message in messages):
        raise NoCommonLayoutError
    layout = _Layout(types, messages[0])
    try:
        layout.walk(message_type)
    except struct.error:
        raise NoCommonLayoutError from None
    if not 0 <= size - layout.position <= _TAIL + _EMPTY_SEQUENCE_TAIL * layout.empty_sequences:
        raise NoCommonLayoutError
    octets = np.frombuffer(raw, np.uint8).reshape(-1, size)
    if not messages[0].startswith(_LITTLE_ENDIAN) or not all(
        (octets[:, at : at + width] == octets[0, at : at + width]).all()
        for at, width in [(0, len(_LITTLE_ENDIAN)), *((at, 4) for at in layout.lengths)]
    ):
        raise NoCommonLayoutError
    rows = np.frombuffer(raw, layout.dtype(size))
    columns = Columns(source)
    columns.update((path, _column(rows, path, kind)) for path, kind in layout.columns.items())
    return columns


def columns_one_by_one(types: Typesdict, message_type: str, messages: Sequence[object], source: str = "") -> Columns:
    """Turn deserialized messages of any layout into the same columns as :func:`columns_at_once`."""
    columns = Columns(source)
    _gather(types, message_type, messages, "", columns)
    return columns


class _Layout:
    """Offsets of the fields in a message, found by walking the definition along one message."""

    def __init__(self, types: Typesdict, message: bytes) -> None:
        self.types = types
        self.message = message
        self.position = _HEADER
        self.columns: dict[str, str] = {}
        """Kind of each column: number, text, time, empty text, empty list."""
        self.numbers: dict[str, tuple[Any, int]] = {}
        """Format and offset of what lies at fixed places."""
        self.lengths: list[int] = []
        """Offsets of the lengths of text and sequences."""
        self.empty_sequences = 0

    def dtype(self, size: int) -> np.dtype[Any]:
        """Return a message of ``size`` bytes as a structured type."""
        formats, offsets = zip(*self.numbers.values(), strict=True) if self.numbers else ((), ())
        return np.dtype({"names": list(self.numbers), "formats": formats, "offsets": offsets, "itemsize": size})

    def walk(self, message_type: str, prefix: str = "") -> None:
        for field in fields_of(self.types, message_type):
            path = prefix + field.name
            if field.count != "one":
                self._many(path, field)
            elif field.format:
                self._number(path, "number", field.format)
            elif field.is_text:
                self._text(path)
            elif field.is_time:
                self.columns[path] = "time"
                self._place(path + ".sec", "<i4")
                self._place(path + ".nanosec", "<u4")
            elif field.is_message:
                self.walk(field.type, path + ".")
            else:
                raise NoCommonLayoutError

    def _many(self, path: str, field: Field) -> None:
        length = field.length if field.count == "array" else self._length()
        self.empty_sequences += not length
        if field.format:
            self._number(path, "number", field.format, (length,))
        elif length:
            raise NoCommonLayoutError
        else:
            self.columns[path] = "empty list"

    def _text(self, path: str) -> None:
        # The length counts the closing zero byte, which some writers leave out of empty text.
        if length := self._length():
            self._number(path, "text", f"S{length}")
        else:
            self.columns[path] = "empty text"

    def _number(self, path: str, kind: str, form: str, shape: tuple[int, ...] = ()) -> None:
        self.columns[path] = kind
        self._place(path, form, shape)

    def _place(self, name: str, form: str, shape: tuple[int, ...] = ()) -> None:
        dtype = np.dtype((form, shape))
        alignment = 1 if dtype.base.kind == "S" else dtype.base.itemsize
        if dtype.itemsize:
            self.position += -(self.position - _HEADER) % alignment
        self.numbers[name] = (dtype, self.position)
        self.position += dtype.itemsize

    def _length(self) -> int:
        self.position += -(self.position - _HEADER) % 4
        self.lengths.append(self.position)
        (length,) = struct.unpack_from("<I", self.message, self.position)
        self.position += 4
        if self.position + length > len(self.message):
            raise NoCommonLayoutError
        return int(length)


def _column(rows: NDArray[Any], path: str, kind: str) -> NDArray[Any]:
    match kind:
        case "time":
            return np.asarray(rows[path + ".sec"].astype(np.int64) * 10**9 + rows[path + ".nanosec"])
        case "text":
            try:
                return _objects([text.decode() for text in rows[path].tolist()])
            except UnicodeDecodeError:
                raise NoCommonLayoutError from None
        case "empty text":
            return _objects([""] * len(rows))
        case "empty list":
            return _objects([[] for _ in rows])
        case _:
            return np.ascontiguousarray(rows[path])


def _gather(types: Typesdict, message_type: str, messages: Sequence[object], prefix: str, columns: Columns) -> None:
    for field in fields_of(types, message_type):
        path = prefix + field.name
        values: list[Any] = [getattr(message, field.name) for message in messages]
        if field.count != "one":
            columns[path] = _gather_many(types, field, values)
        elif field.format:
            columns[path] = np.array(values, field.format)
        elif field.is_text:
            columns[path] = _objects(values)
        elif field.is_time:
            columns[path] = np.array([nanoseconds(value) for value in values], np.int64)
        else:
            _gather(types, field.type, values, path + ".", columns)


def _gather_many(types: Typesdict, field: Field, values: list[Any]) -> NDArray[Any]:
    if field.format:
        if len({len(value) for value in values}) > 1:
            return _objects(values)
        return np.array(values, field.format).reshape(len(values), len(values[0]) if values else field.length)
    if field.is_text:
        return _objects(values)
    return _objects([[as_dict(types, field.type, element) for element in value] for value in values])


def _objects(values: list[Any]) -> NDArray[Any]:
    return np.fromiter(values, dtype=object, count=len(values))
