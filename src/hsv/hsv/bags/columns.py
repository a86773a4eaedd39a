"""The messages of a topic, and their fields as columns: arrays with one row per message.

A column is named by the path of its field, such as ``header.stamp``. For n messages, a number becomes an array of shape
(n,), a time or duration one of int64 nanoseconds, shape (n,), and an array or sequence of numbers one of shape
(n, length). A nested message becomes the columns of its fields. Texts, sequences of different lengths, and lists of
texts, times or messages (as dictionaries) become arrays of objects, shape (n,).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from hsv.bags.definitions import MAX_SURPLUS, Field, deserialized, fields_of, plain
from hsv.bags.description import TOPIC_OF
from hsv.bags.messages import ENCAPSULATION, MessageError, Structure
from hsv.base.errors import RecordingError, SignalError

Read = Callable[[str], Sequence[Any] | NDArray[Any]]
"""Function that returns the values of one field, given by its path, in all messages."""


class Columns(dict[str, NDArray[Any]]):
    """Fields of a topic's messages: arrays by field path. A field that the definition lacks raises a RecordingError."""

    def __init__(self, source: str = "") -> None:
        super().__init__()
        self.source = source
        """Source of the messages, for error messages."""

    def rows(self, rows: NDArray[np.intp]) -> Columns:
        """Return a copy with only the given rows of every column."""
        chosen = Columns(self.source)
        chosen.update((name, column[rows]) for name, column in self.items())
        return chosen

    def __missing__(self, name: str) -> NDArray[Any]:
        raise RecordingError(f"{self.source}: recorded with another definition, expected a field {name}")


def read_at_once(types: Typesdict, message_type: str, messages: Sequence[bytes]) -> Read | None:
    """Return a function that reads one field of all ``messages`` (at least one, CDR) at once, if they share a layout.

    Return None if a message is invalid, is big-endian, has another layout than the first, or contains wide text or a
    non-empty list of texts or messages. Such messages must be read with :func:`read_one_by_one`.
    """
    try:
        structure = Structure(types, message_type, messages[0])
    except MessageError:
        return None
    surplus = len(messages[0]) - ENCAPSULATION - structure.size
    rows = structure.rows(messages) if structure.complete and surplus <= MAX_SURPLUS else None
    if rows is None:
        return None
    names = structure.dtype.names or ()
    try:
        texts = {n: [text.decode() for text in rows[n].tolist()] for n in names if structure.dtype[n].kind == "S"}
    except UnicodeDecodeError:
        return None
    # A sequence of texts or messages is not part of the structure: it is empty in every message.
    return lambda path: texts[path] if path in texts else rows[path] if path in names else [[] for _ in messages]


def read_one_by_one(messages: Sequence[object]) -> Read:
    """Return a function that reads a field of deserialized ``messages``, whose layouts may differ."""
    return lambda path: list(map(attrgetter(path), messages))


def columns_of(types: Typesdict, message_type: str, read: Read, source: str = "") -> Columns:
    """Return the columns of messages of a type, with values from the function ``read``; errors name ``source``."""
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


@contextmanager
def expecting_fields(source: object) -> Iterator[None]:
    """Raise a RecordingError that names ``source`` if a message lacks a field, has an invalid signal or is invalid."""
    try:
        yield
    except AttributeError as error:
        if not (kind := getattr(error.obj, "__msgtype__", None)):
            raise
        raise RecordingError(
            f"{source}: {kind}: recorded with another definition, expected a field {error.name}"
        ) from None
    except SignalError as error:
        raise RecordingError(f"{source}: topic {TOPIC_OF[error.signal]}: {error}") from error
    except MessageError as error:
        raise RecordingError(f"{source}: {error}") from error


@dataclass(frozen=True)
class Track:
    """The recorded or replayed messages of one topic in their order, with times and type."""

    topic: str
    type: str
    """``package/msg/Type``."""
    types: Typestore
    """Definitions of the type and its dependencies."""
    times: list[int]
    """Simulated times, ns."""
    data: list[bytes]
    """Messages in CDR with the header of four bytes."""
    source: str = ""
    """Source of the messages, for error messages."""

    def cut(self, count: int) -> Track:
        """Return a copy with only the first ``count`` messages."""
        return self.rows(range(min(count, len(self.data))))

    def rows(self, rows: Sequence[int]) -> Track:
        """Return a copy with only the messages at the indices ``rows``."""
        return replace(self, times=[self.times[row] for row in rows], data=[self.data[row] for row in rows])

    def columns(self) -> Columns:
        """Return all fields of all messages, one array per field; raise a RecordingError if a message is invalid."""
        types = self.types.fielddefs
        read = read_at_once(types, self.type, self.data) if self.data else None
        read = read or read_one_by_one([message for _, message in self.decode()])
        return columns_of(types, self.type, read, f"{self.source}: topic {self.topic}")

    def decode(self) -> Iterator[tuple[int, Any]]:
        """Yield each message as (time in ns, deserialized message); raise a RecordingError if one is invalid."""
        for time, message in zip(self.times, self.data, strict=True):
            try:
                yield time, deserialized(self.types, message, self.type)
            except SerdeError as error:
                raise RecordingError(f"{self.source}: topic {self.topic}: message at {time} ns: {error}") from None
