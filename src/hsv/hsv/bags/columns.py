"""Decode all messages of a topic into one array per field.

The names of the columns are field paths such as ``header.stamp``. Times and durations become int64 nanoseconds (n,),
numbers arrays (n,), and arrays or sequences of numbers arrays (n, length). Arrays of objects (n,) hold texts, sequences
of different lengths, and lists of messages as lists of dictionaries.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces.typing import Typesdict

from hsv.bags.fields import Field, fields_of, plain
from hsv.bags.messages import ENCAPSULATION, MessageError, Structure
from hsv.base.errors import RecordingError

_TAIL = 3
"""Maximum padding at the end of a message, bytes."""
_EMPTY_SEQUENCE_TAIL = 4
"""Additional padding per empty sequence, bytes: serialize_message of rmw_fastrtps reserves space as if empty sequences
were aligned like full ones. Messages received over DDS do not have it."""

Read = Callable[[str], Sequence[Any] | NDArray[Any]]
"""Function that returns the values of all messages at a field path."""


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


def read_at_once(types: Typesdict, message_type: str, messages: Sequence[bytes]) -> Read | None:
    """Return a function that reads messages of one layout; ten thousand take milliseconds.

    Args:
        types: Definitions of the type and its dependencies.
        message_type: ``package/msg/Type``.
        messages: At least one message in CDR with its header.

    Returns:
        The function, or None if the messages differ in layout, are big-endian, or have texts or messages in a sequence;
        then use :func:`read_one_by_one`.
    """
    try:
        structure = Structure(types, message_type, messages[0])
    except MessageError:
        return None
    empty = sum(length == 0 for _, length in structure.lengths.values())
    surplus = len(messages[0]) - ENCAPSULATION - structure.size
    if not structure.complete or surplus > _TAIL + _EMPTY_SEQUENCE_TAIL * empty:
        return None
    if (rows := structure.rows(messages)) is None:
        return None
    names = structure.dtype.names or ()
    try:
        texts = {n: [text.decode() for text in rows[n].tolist()] for n in names if structure.dtype[n].kind == "S"}
    except UnicodeDecodeError:
        return None
    # Sequences of texts or messages have no place in the structure: they are empty.
    return lambda path: texts[path] if path in texts else rows[path] if path in names else [[] for _ in messages]


def read_one_by_one(messages: Sequence[object]) -> Read:
    """Return a function that reads deserialized messages of any layout."""
    return lambda path: list(map(attrgetter(path), messages))


def columns_of(types: Typesdict, message_type: str, read: Read, source: str = "") -> Columns:
    """Return the columns of the messages of a type that ``read`` reads; ``source`` is for error messages."""
    columns = Columns(source)

    def gather(kind: str, prefix: str) -> None:
        for field in fields_of(types, kind):
            path = prefix + field.name
            if field.count == "one" and field.is_time:
                seconds, nanoseconds = (np.array(read(f"{path}.{part}"), np.int64) for part in ("sec", "nanosec"))
                columns[path] = seconds * 10**9 + nanoseconds
            elif field.count == "one" and field.is_message:
                gather(field.type, path + ".")
            elif field.format:
                columns[path] = _numbers(field, read(path))
            else:
                columns[path] = _objects([plain(types, field, value) for value in read(path)])

    gather(message_type, "")
    return columns


def _numbers(field: Field, values: Sequence[Any] | NDArray[Any]) -> NDArray[Any]:
    if field.count == "one":
        return np.array(values, field.format)
    if len({len(value) for value in values}) > 1:
        return _objects(values)
    return np.array(values, field.format).reshape(len(values), len(values[0]) if len(values) else field.length)


def _objects(values: Sequence[Any] | NDArray[Any]) -> NDArray[Any]:
    return np.fromiter(values, dtype=object, count=len(values))
