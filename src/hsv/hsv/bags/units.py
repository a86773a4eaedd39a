"""Units of the fields of a recorded topic, from the comments of its message definition.

A comment begins with a unit (``m/s``), or with the units of the elements of an array, which repeat (``rad, rad s:
...``). The units after ``then`` repeat for all further elements (``m, m/s, then rad, rad s: ...``). ``-`` means no
unit. Any other beginning means that the unit is unknown.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from rosbags.interfaces.typing import Typesdict

from hsv.bags.definitions import SEPARATOR, fields_of

KNOWN = ("-", "s", "m", "m/s", "rad", "rad/s", "rad s", "kg^0.5 m", "kg^0.5 m/s", "N", "N m", "Pa")
NANOSECONDS = "ns"
"""Unit of times and durations, which are exported as one number."""

_FIELD = re.compile(r"^\s*[\w/]+(?:\[[^\]]*\])?(?:<=\d+)?\s+(?P<name>\w+)\s*(?:#\s*(?P<comment>.*))?$")


@dataclass(frozen=True)
class Units:
    """Units of the elements of a field: of the ``first`` elements, then ``others``, repeated for all further elements.

    A number has a single element.
    """

    first: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    def of(self, index: int = 0) -> str:
        """Return the unit of an element; empty if it has none or it is unknown."""
        if index < len(self.first):
            unit = self.first[index]
        elif self.others:
            unit = self.others[(index - len(self.first)) % len(self.others)]
        else:
            unit = ""
        return "" if unit == "-" else unit

    def together(self, size: int) -> str:
        """Return the units of ``size`` elements, separated by commas, or their common unit."""
        named = [self.of(index) for index in range(size)]
        return ", ".join(named[:1] if len(set(named)) == 1 else named)


def units_of(definition: str, types: Typesdict, message_type: str) -> dict[str, Units]:
    """Return units by field path: the fields of a type from ``types``, units from comments in its ``definition``."""
    comments = _comments(definition, message_type)
    found: dict[str, Units] = {}

    def walk(kind: str, prefix: str) -> None:
        for field in fields_of(types, kind):
            path = prefix + field.name
            if field.is_time and field.count == "one":
                found[path] = Units((NANOSECONDS,))
            elif field.is_message and field.count == "one":
                walk(field.type, path + ".")
            else:
                found[path] = parse_units(comments.get((kind, field.name), ""))

    walk(message_type, "")
    return found


def parse_units(comment: str) -> Units:
    """Return the units at the beginning of a comment."""
    head = comment.partition(":")[0]
    first, then, others = head.partition("then ")
    if then:
        return Units(_leading(first), _leading(others))
    return Units((), _leading(head))


def _leading(text: str) -> tuple[str, ...]:
    units = []
    for word in (word.strip() for word in text.split(",")):
        if word not in KNOWN:
            break
        units.append(word)
    return tuple(units)


def _comments(definition: str, message_type: str) -> dict[tuple[str, str], str]:
    comments = {}
    for number, part in enumerate(definition.split(f"\n{SEPARATOR}\n")):
        kind, text = message_type, part
        if number:
            head, _, text = part.partition("\n")
            package, _, name = head.removeprefix("MSG: ").strip().partition("/")
            kind = f"{package}/msg/{name.removeprefix('msg/')}"
        for line in text.splitlines():
            if match := _FIELD.match(line):
                comments[kind, match["name"]] = match["comment"] or ""
    return comments
