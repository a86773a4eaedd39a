"""The messages of one topic, from a bag or from a replay."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from hsv.bags.columns import Columns, columns_of, read_at_once, read_one_by_one
from hsv.bags.description import TOPIC_OF
from hsv.bags.messages import MessageError
from hsv.bags.typestore import deserialized
from hsv.base.errors import RecordingError, SignalError


@contextmanager
def expecting_fields(source: object) -> Iterator[None]:
    """Convert errors of a message with a missing field or an invalid signal to RecordingErrors.

    Raises:
        RecordingError: The error with ``source``, the type or topic of the message, and the field.
    """
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
    """The messages of one topic in their order."""

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
        """Return the first ``count`` messages."""
        return self.rows(range(min(count, len(self.data))))

    def rows(self, rows: Iterable[int]) -> Track:
        """Return the messages in the given ``rows``."""
        chosen = [(self.times[row], self.data[row]) for row in rows]
        times, data = [time for time, _ in chosen], [message for _, message in chosen]
        return Track(self.topic, self.type, self.types, times, data, self.source)

    def columns(self) -> Columns:
        """Return all decoded messages, one array per field; see :mod:`hsv.bags.columns`.

        Raises:
            RecordingError: A message does not fit its definition.
        """
        types = self.types.fielddefs
        read = read_at_once(types, self.type, self.data) if self.data else None
        read = read or read_one_by_one([message for _, message in self.decode()])
        return columns_of(types, self.type, read, f"{self.source}: topic {self.topic}")

    def decode(self) -> Iterator[tuple[int, Any]]:
        """Yield time (ns) and deserialized message of each message.

        Raises:
            RecordingError: A message does not fit its definition.
        """
        for time, message in zip(self.times, self.data, strict=True):
            try:
                yield time, deserialized(self.types, message, self.type)
            except SerdeError as error:
                raise RecordingError(f"{self.source}: topic {self.topic}: message at {time} ns: {error}") from None
