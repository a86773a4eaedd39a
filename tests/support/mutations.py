"""Mutated files: flipped bits, cut and doubled blocks, moved lines, replaced keys and values, deep nesting."""

from __future__ import annotations

import re
from dataclasses import dataclass
from random import Random
from typing import Any

from hypothesis import strategies as st

_KEY = re.compile(rb"[A-Za-z_]\w*(?=[\"']?\s*[=:])")
_VALUE = re.compile(rb"\"[^\"\n]*\"|(?<![\w.])[+-]?\d[\w.+-]*|\b(?:true|false|null)\b")
_KEYS = (b"period", b"fault", b"vehicle", b"name", b"extends", b"tube", b"definition", b"controller", b"a", b"<<")
_VALUES = (
    *(b"0", b"-1", b"1", b"-0.0", b"1e308", b"-1e308", b"1e999", b"5e-324", b"nan", b"inf", b".nan", b"-.inf", b"NaN"),
    *(b"9" * 30, b"9" * 400, b"9" * 5000, b"1e-400", b"true", b"null", b"[]", b"{}", b"[[]]", b"[1, 2.0]", b"{a = 1}"),
    *(b'""', b'"\\u0000"', b'"\\u001b[31m"', b'"1e400 ft"', b'"9**9**9**9 ft"', b'"-1 s"', b'"1e-300 s"', b'"nan"'),
    *(b"2026-02-30", b"1979-05-27T07:32:00Z", b"2026-01-01", b"~", b"*a", b"&a [*a]", b"!!binary x", b"0x" + b"f" * 50),
    *(b'"100 %"', b'"/"', b'"."', b'"../x.toml"', b'"case1"', b"'", b'"', b"\xff", b"{ uniform = [0, 1] }", b"1:2:3"),
)


_SHOWN = 60
"""Number of bytes shown of a mutated file, from the first difference on."""


@dataclass(frozen=True)
class Mutated:
    """A mutated file and the description of its mutations."""

    data: bytes
    source: bytes
    how: tuple[str, ...]

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(repr(self))

    def __repr__(self) -> str:
        at = next((i for i, pair in enumerate(zip(self.data, self.source, strict=False)) if pair[0] != pair[1]), 0)
        where = f"{self.data[max(at - _SHOWN, 0) : at + _SHOWN]!r} around byte {at}"
        return f"<{len(self.data)} of {len(self.source)} bytes, {', '.join(self.how)}: {where}>"


def mutated(*sources: bytes) -> st.SearchStrategy[Mutated]:
    """Return a strategy that draws one of the files ``sources`` with one to four mutations."""

    @st.composite
    def draw_one(draw: st.DrawFn) -> Mutated:
        random = draw(st.randoms(use_true_random=False))
        data = source = draw(st.sampled_from(sources))
        mutations = draw(st.lists(st.sampled_from(_MUTATIONS), min_size=1, max_size=4))
        for mutation in mutations:
            data = mutation(data, random)
        return Mutated(data, source, tuple(mutation.__name__.strip("_") for mutation in mutations))

    return draw_one()


def _flipped(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data)) if data else 0
    return data[:at] + bytes([data[at] ^ 1 << random.randrange(8)]) + data[at + 1 :] if data else data


def _cut(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data) + 1)]


def _removed(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data) + 1)
    return data[:at] + data[at + random.choice((1, 8, 100, 5000)) :]


def _block_doubled(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data) + 1)
    return data[:at] + data[max(at - random.choice((1, 16, 500, 5000)), 0) : at] + data[at:]


def _block_zeroed(data: bytes, random: Random) -> bytes:
    at, size = random.randrange(len(data) + 1), random.choice((1, 8, 512))
    return data[:at] + bytes(len(data[at : at + size])) + data[at + size :]


def _line_moved(data: bytes, random: Random) -> bytes:
    lines = data.splitlines(keepends=True) or [b""]
    line = random.choice(lines)
    lines.insert(random.randrange(len(lines) + 1), line)
    return b"".join(lines)


def _line_removed(data: bytes, random: Random) -> bytes:
    lines = data.splitlines(keepends=True) or [b""]
    del lines[random.randrange(len(lines))]
    return b"".join(lines)


def _key_renamed(data: bytes, random: Random) -> bytes:
    return _replaced(data, _KEY, random.choice(_KEYS), random)


def _value_replaced(data: bytes, random: Random) -> bytes:
    return _replaced(data, _VALUE, random.choice(_VALUES), random)


def _nested(data: bytes, random: Random) -> bytes:
    depth = random.choice((3, 60, 70, 1200, 100_000))
    opening, closing = random.choice(((b"[", b"]"), (b"{a: ", b"}"), (b"{a=", b"}"), (b'{"a":', b"}")))
    return _replaced(data, _VALUE, opening * depth + b"1" + closing * depth, random)


def _replaced(data: bytes, pattern: re.Pattern[bytes], by: bytes, random: Random) -> bytes:
    places = [match.span() for match in pattern.finditer(data, 0, 100_000)]
    if not places:
        return data
    start, end = random.choice(places)
    return data[:start] + by + data[end:]


_EDITS = (_line_moved, _line_removed, _key_renamed, _value_replaced, _value_replaced, _nested)
_MUTATIONS = (_flipped, _cut, _removed, _block_doubled, _block_zeroed, *_EDITS)
