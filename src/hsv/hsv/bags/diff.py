"""Comparison of two recordings of one topic: number, order and bytes of the messages, then every field."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rosbags.serde import SerdeError

from hsv.bags.columns import Columns, Track
from hsv.bags.definitions import deserialized


@dataclass(frozen=True)
class Difference:
    """A difference between two recordings of a topic: in a field, in the time of a message, or a missing message."""

    topic: str
    step: int
    """Step number in the message, or the row of a message without one."""
    time_ns: int
    field: str
    expected: Any
    actual: Any

    def __str__(self) -> str:
        return f"step {self.step} {self.topic} {self.field}: {self.expected!r} became {self.actual!r}"


@dataclass(frozen=True)
class Comparison:
    """Comparison of two recordings of a topic; its ``first`` difference is None if they agree within tolerance."""

    topic: str
    expected_count: int
    actual_count: int
    common_count: int
    """Number of messages with equal times, which are compared with each other."""
    different_bytes: int
    """Number of common messages whose bytes differ."""
    different_padding: int = 0
    """Number of common messages that differ in padding only; DDS does not initialise padding."""
    first: Difference | None = None
    largest: dict[str, float] = field(default_factory=dict)
    """Largest absolute difference of each field that differs, by field; NaN for a field that is not a number."""

    @property
    def identical(self) -> bool:
        """Whether both recordings have the same messages, equal in all bytes except padding."""
        return (
            self.expected_count == self.actual_count == self.common_count
            and self.different_bytes == self.different_padding
            and self.first is None
        )


def compare(expected: Track, actual: Track, tolerance: float = 0.0) -> Comparison:
    """Compare two recordings of one topic, message by message at equal times.

    Floating-point numbers a and b are equal if |a - b| <= max(tolerance, tolerance max(|a|, |b|)), if both are NaN, or
    if both are the same infinity. Integers and texts must be the same. Lists are compared element by element.

    Args:
        expected: Recorded messages.
        actual: Messages to compare with them.
        tolerance: Absolute and relative tolerance.
    """
    counts = len(expected.data), len(actual.data)
    found: list[Difference] = []
    apart = []
    if expected.times != actual.times:
        apart.append(_apart(expected, actual))
        _, rows, others = np.intersect1d(expected.times, actual.times, return_indices=True)
        expected, actual = expected.rows(rows.tolist()), actual.rows(others.tolist())
    common = len(expected.data)
    pairs = list(zip(expected.data, actual.data, strict=True))
    different = sum(a != b for a, b in pairs)
    padding = sum(a != b and _content(expected, a) == _content(actual, b) for a, b in pairs)
    largest: dict[str, float] = {}
    if different > padding or (not common and counts != (0, 0)):
        ours, theirs = expected.columns(), actual.columns()
        steps = ours.get("step", np.arange(common))

        def note(row: int, name: str, a: Any, b: Any) -> None:
            step, time = (int(steps[row]), expected.times[row]) if common else (0, 0)
            found.append(Difference(expected.topic, step, time, name, a, b))

        for name in dict.fromkeys((*ours, *theirs)):
            if name not in ours or name not in theirs:
                note(0, name, name in ours, name in theirs)
            elif common:
                _compare_column(name, ours, theirs, tolerance, largest, note)
    first = min(found + apart, key=lambda difference: difference.time_ns, default=None)
    return Comparison(expected.topic, *counts, common, different, padding, first, largest)


def _apart(expected: Track, actual: Track) -> Difference:
    """Return the first difference in the times of two recordings: their number, a time that one lacks, or the order."""
    ours, theirs = expected.times, actual.times
    only = np.setxor1d(ours, theirs)
    swapped = (a for a, b in zip(ours, theirs, strict=False) if a != b)
    time = int(only[0]) if len(only) else next(swapped, ours[-1])
    track = expected if time in ours else actual
    row = track.times.index(time)
    step = int(track.rows([row]).columns().get("step", [row])[0])
    if len(ours) != len(theirs):
        return Difference(expected.topic, step, time, "number of messages", len(ours), len(theirs))
    if len(only):
        words = ("recorded", "missing") if track is expected else ("missing", "recorded")
        return Difference(expected.topic, step, time, "message", *words)
    return Difference(expected.topic, step, time, "time (ns)", time, theirs[row])


def _content(track: Track, message: bytes) -> bytes:
    """Return the message serialized anew from its fields, with zero padding; unchanged if it cannot be decoded."""
    try:
        return bytes(track.types.serialize_cdr(deserialized(track.types, message, track.type), track.type))
    except SerdeError:
        return message


def _compare_column(
    name: str, ours: Columns, theirs: Columns, tolerance: float, largest: dict[str, float], note: Any
) -> None:
    a, b = ours[name], theirs[name]
    if a.dtype == object or b.dtype == object or a.shape != b.shape:
        rows = [row for row in range(len(a)) if not _alike(_plain(a[row]), _plain(b[row]), tolerance)]
        if rows:
            largest[name] = math.nan
            note(rows[0], name, _plain(a[rows[0]]), _plain(b[rows[0]]))
        return
    equal = a == b
    if a.dtype.kind == "f":
        equal |= np.isnan(a) & np.isnan(b)
    if equal.all():
        return
    with np.errstate(invalid="ignore", over="ignore"):
        difference = np.abs(a.astype(np.float64) - b.astype(np.float64))
        largest[name] = float(np.max(np.where(equal, 0.0, difference)))
        if a.dtype.kind == "f":
            limit = np.maximum(tolerance, tolerance * np.maximum(np.abs(a), np.abs(b)))
            equal |= np.isfinite(a) & np.isfinite(b) & (difference <= limit)
    if not equal.all():
        index = tuple(int(i) for i in np.argwhere(~equal)[0])
        suffix = "".join(f"[{i}]" for i in index[1:])
        note(index[0], name + suffix, a[index].item(), b[index].item())


def _alike(a: Any, b: Any, tolerance: float) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        if math.isfinite(a) and math.isfinite(b):
            return abs(a - b) <= max(tolerance, tolerance * max(abs(a), abs(b)))
        return a == b or (math.isnan(a) and math.isnan(b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_alike(a[key], b[key], tolerance) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(_alike(x, y, tolerance) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
