"""Messages as CDR bytes and back, by one table of formats for each type.

rclpy converts a typed message field by field, which takes 10 to 50 us; a message whose lengths are known is one
:class:`struct.Struct`, and takes some 3 us. On the wire, in bags and for every other node nothing is different.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import make_dataclass
from functools import cache
from operator import itemgetter
from typing import Any, Protocol

from hsv.bags.description import WIRE_ALIGNMENT
from hsv.base.errors import RunError
from hsv_node.messages import message_class

_CODES = {
    "boolean": "?",
    "octet": "B",
    "uint8": "B",
    "int8": "b",
    "uint16": "H",
    "int16": "h",
    "uint32": "I",
    "int32": "i",
    "uint64": "Q",
    "int64": "q",
    "float": "f",
    "double": "d",
}
"""Format character of :mod:`struct` for every number type, by its name in rosidl."""

_LENGTH = "I"
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
"""Encapsulation header of CDR; alignment counts from its end."""

_FIELD_TYPE = re.compile(r"(?:sequence<)?(?P<of>[\w/]+)(?:<\d+>)?(?:\[(?P<count>\d+)\])?(?:, \d+)?>?")
"""A type of a field as rosidl writes it."""


@cache
def codec(message_type: str) -> Codec:
    """Return the codec of a type such as ``"hsv_msgs/msg/VehicleState"``."""
    return Codec(message_type)


class _Kind(Protocol):
    """A kind of field, as Python expressions from which the functions of a codec are generated."""

    def lay(self, layout: _Layout) -> str:
        """Append its places to ``layout``, and return what it is made of, of the ``values`` that stand there."""


class _Number:
    def __init__(self, code: str) -> None:
        self.code = code

    def lay(self, layout: _Layout) -> str:
        return f"values[{layout.put(self.code)}]"


class _Text:
    def lay(self, layout: _Layout) -> str:
        return f"values[{layout.put('s', layout.length())}][:-1].decode(errors='replace')"


class _Many:
    """An array, or a sequence where ``count`` is None."""

    def __init__(self, of: _Kind, count: int | None) -> None:
        self._of, self._count = of, count

    def lay(self, layout: _Layout) -> str:
        count = layout.length() if self._count is None else self._count
        if isinstance(self._of, _Number):
            first = layout.put(self._of.code, count)
            return f"[*values[{first}:{first + count}]]"
        return f"[{', '.join(self._of.lay(layout) for _ in range(count))}]"


class _Message:
    def __init__(self, message_type: str) -> None:
        types = message_class(message_type).get_fields_and_field_types()
        self._fields = {name: _kind(of) for name, of in types.items()}
        self._name = message_type.replace("/", "_")
        self._class = make_dataclass(self._name, self._fields, slots=True)

    def lay(self, layout: _Layout) -> str:
        layout.classes[self._name] = self._class
        return f"{self._name}({', '.join(kind.lay(layout) for kind in self._fields.values())})"


@cache
def _message(message_type: str) -> _Message:
    """Return the one kind of a type, so that its messages are of one class wherever they stand."""
    return _Message(message_type)


def _kind(field_type: str) -> _Kind:
    found = _FIELD_TYPE.fullmatch(field_type)
    of = found["of"] if found else field_type
    if of in _CODES:
        kind: _Kind = _Number(_CODES[of])
    elif of == "string":
        kind = _Text()
    elif "/" in of:
        kind = _message("/msg/".join(of.split("/")))
    else:
        raise TypeError(f"field type {field_type}: expected numbers, text or messages")
    if field_type.startswith("sequence<"):
        return _Many(kind, None)
    return _Many(kind, int(found["count"])) if found and found["count"] else kind


class _Layout:
    """Offsets of all fields in a message whose texts and sequences have given lengths.

    ``length_at`` gives the length that stands at an offset and a place among the values. ``pack`` pads the message as
    DDS does; it does without DDS, too, so that bags of nodes in one process have the same bytes.
    """

    def __init__(self, kind: _Kind, length_at: Callable[[int, int], int]) -> None:
        self._length_at = length_at
        self._formats = ["<4s"]
        self._offset, self._values = 0, 1
        self._places: list[int] = []
        self._lengths: list[int] = []
        self.classes: dict[str, Any] = {}
        made = kind.lay(self)
        self.made: Callable[[tuple[Any, ...]], Any] = eval(f"lambda values: {made}", self.classes)
        self.struct = struct.Struct("".join(self._formats))
        self.pack = struct.Struct(f"{self.struct.format}{-self.struct.size % WIRE_ALIGNMENT}x").pack
        self.lengths = tuple(self._lengths)
        # Of a tuple, and of a tuple of one: both are there for a first place of two.
        self._lengths_in = itemgetter(*self._places, *self._places) if self._places else lambda values: ()
        self._twice = (*self.lengths, *self.lengths)

    def put(self, code: str, count: int = 1) -> int:
        """Append so many numbers, or a text of so many bytes, aligned; return the place of the first value.

        A text has a place whatever its length: some write an empty one without the zero that ends it.
        """
        place = self._values
        if count or code == "s":
            size = struct.calcsize("<" + code)
            padding = -self._offset % size
            self._formats.append(f"{padding}x{count}{code}")
            self._offset += padding + size * count
            self._values += 1 if code == "s" else count
        return place

    def length(self) -> int:
        """Append a length and return it."""
        self._places.append(self.put(_LENGTH))
        offset = len(_LITTLE_ENDIAN) + self._offset - struct.calcsize(_LENGTH)
        self._lengths.append(self._length_at(offset, self._places[-1]))
        return self._lengths[-1]

    def unpack(self, data: bytes) -> tuple[Any, ...] | None:
        """Return the values in ``data``, None if its lengths are others."""
        # rmw_fastrtps may send more than a message has.
        if len(data) < self.struct.size:
            return None
        values = self.struct.unpack_from(data)
        if values[0][:2] != _LITTLE_ENDIAN[:2]:
            return None
        return values if self._lengths_in(values) == self._twice else None

    def fits(self, values: tuple[Any, ...]) -> bool:
        """Return whether these are so many values, with these lengths."""
        return len(values) == self._values and self._lengths_in(values) == self._twice


class Codec:
    """Turns messages of a type into CDR bytes and back.

    As objects they have the fields of the type as attributes, arrays and sequences as lists.
    """

    def __init__(self, message_type: str) -> None:
        self.type = message_type
        self._kind = _message(message_type)
        self._layouts: dict[tuple[int, ...], _Layout] = {}
        self._last: _Layout | None = None
        """The layout of what was read last, and of what was packed last."""
        self._packed: _Layout | None = None

    def pack(self, values: tuple[Any, ...]) -> bytes:
        """Return as CDR bytes a message that is given as :meth:`unpack` does, but for the encapsulation.

        Raises:
            struct.error: A value is no number of its type, or there are not as many as the lengths among them say.
        """
        whole = (_LITTLE_ENDIAN, *values)
        layout = self._packed
        if layout is None or not layout.fits(whole):
            layout = self._packed = self._keep(_Layout(self._kind, lambda _, place: whole[place]))
        return layout.pack(*whole)

    def decode(self, data: bytes) -> Any:
        """Return the message that CDR bytes are.

        Raises:
            RunError: They are no little-endian CDR of this type.
        """
        values = self.unpack(data)
        assert self._last is not None
        return self._last.made(values)

    def message(self, values: tuple[Any, ...]) -> Any:
        """Return as an object what :meth:`unpack` has given."""
        return next(layout for layout in self._layouts.values() if layout.fits(values)).made(values)

    def unpack(self, data: bytes) -> tuple[Any, ...]:
        """Return all that stands in CDR bytes: the encapsulation, and the fields in order as numbers and bytes.

        A text or sequence is preceded by its length.

        Raises:
            RunError: They are no little-endian CDR of this type.
        """
        layout = self._last
        values = layout.unpack(data) if layout else None
        if values is None:
            layout = self._last = self._measure(data)
            values = layout.struct.unpack_from(data)
        return values

    def _measure(self, data: bytes) -> _Layout:
        if data[:2] != _LITTLE_ENDIAN[:2]:
            raise RunError(f"{self.type}: CDR that begins with {data[:2].hex()}, expected 0001, little-endian")

        def length(offset: int, _: int) -> int:
            found: int = struct.unpack_from("<" + _LENGTH, data, offset)[0]
            if found > len(data):
                raise struct.error(f"length {found} at byte {offset}")
            return found

        try:
            layout = _Layout(self._kind, length)
            layout.struct.unpack_from(data)
        except struct.error as error:
            raise RunError(f"{self.type}: {len(data)} bytes that are no such message: {error}") from None
        return self._keep(layout)

    def _keep(self, layout: _Layout) -> _Layout:
        return self._layouts.setdefault(layout.lengths, layout)
