"""Decode all messages of a topic at once into one array per field.

The names of the columns are field paths such as ``header.stamp``. Times and durations become int64 nanoseconds (n,),
numbers arrays (n,), and arrays or sequences of numbers arrays (n, length). Arrays of objects (n,) hold texts, sequences
of different lengths, and lists of messages as lists of dictionaries.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces.typing import Typesdict

from hsv.bags.fields import Field, as_dict, fields_of, nanoseconds
from hsv.bags.messages import ENCAPSULATION, MessageError, Structure
from hsv.base.errors import RecordingError

_TAIL = 3
"""Maximum padding at the end of a message, bytes."""
_EMPTY_SEQUENCE_TAIL = 4
"""Additional padding per empty sequence, bytes: serialize_message of rmw_fastrtps reserves space as if empty sequences
were aligned like full ones. Messages received over DDS do not have it."""


class Columns(dict[str, NDArray[Any]]):
    """Arrays by field path; reading a field that the definition does not have raises a RecordingError."""

    def __init__(self, source: str = "") -> None:
        super().__init__()
        self.source = source
        """Source of the messages, for error messages."""

    def rows(self, rows: NDArray[np.intp]) -> Columns:
        """Return the chosen rows of every column."""
        chosen = Columns(self.source)
        chosen.update((name, column[rows]) for name, column in self.items())
        return chosen

    def __missing__(self, name: str) -> NDArray[Any]:
        raise RecordingError(f"{self.source}: recorded with another definition, expected a field {name}")


def columns_at_once(types: Typesdict, message_type: str, messages: Sequence[bytes], source: str = "") -> Columns | None:
    """Decode messages that all have the layout of the first; ten thousand take milliseconds.

    Args:
        types: Definitions of the type and its dependencies.
        message_type: ``package/msg/Type``.
        messages: At least one message in CDR with its header.
        source: Source of the messages, for error messages.

    Returns:
        The columns, or None if the messages differ in layout, are big-endian, or have texts or messages in a sequence;
        then use :func:`columns_one_by_one`.
    """
    try:
        structure = Structure(types, message_type, messages[0])
    except MessageError:
        return None
    empty = sum(length == 0 for _, length in structure.lengths.values())
    surplus = len(messages[0]) - ENCAPSULATION - structure.size
    if not structure.complete or surplus > _TAIL + _EMPTY_SEQUENCE_TAIL * empty:
        return None
    rows = structure.rows(messages)
    columns = Columns(source)
    try:
        return None if rows is None else _take(types, message_type, rows, "", columns)
    except UnicodeDecodeError:
        return None


def columns_one_by_one(types: Typesdict, message_type: str, messages: Sequence[object], source: str = "") -> Columns:
    """Convert deserialized messages of any layout to the columns of :func:`columns_at_once`."""
    columns = Columns(source)
    _gather(types, message_type, messages, "", columns)
    return columns


def _take(types: Typesdict, message_type: str, rows: NDArray[Any], prefix: str, columns: Columns) -> Columns:
    """Add the columns of a type from a structured array of messages, whose lists of messages and texts are empty."""
    for field in fields_of(types, message_type):
        path = prefix + field.name
        if field.format:
            columns[path] = np.ascontiguousarray(rows[path])
        elif field.count != "one":
            columns[path] = _objects([[] for _ in rows])
        elif field.is_text:
            columns[path] = _objects([text.decode() for text in rows[path].tolist()])
        elif field.is_time:
            columns[path] = rows[path + ".sec"].astype(np.int64) * 10**9 + rows[path + ".nanosec"]
        else:
            _take(types, field.type, rows, path + ".", columns)
    return columns


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
