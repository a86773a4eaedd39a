"""The fields of message types from parsed message definitions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.typesys.store import Typestore

TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Types of times: each has int32 sec and uint32 nanosec, which together are one number."""
_FORMATS = {"bool": "?", "byte": "u1", "char": "u1", "float32": "<f4", "float64": "<f8"} | {
    f"{sign}int{bits}": f"<{code}{bits // 8}" for sign, code in (("", "i"), ("u", "u")) for bits in (8, 16, 32, 64)
}


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message type."""

    name: str
    type: str
    """``package/msg/Type`` or the name of a base type."""
    format: str | None
    """numpy format of a number; None for texts and messages."""
    count: Literal["one", "array", "sequence"]
    length: int
    """Number of elements of an array; 0 otherwise."""

    @property
    def is_text(self) -> bool:
        """Whether the field is a text, bounded or unbounded."""
        return self.type == "string"

    @property
    def is_time(self) -> bool:
        """Whether the field is a time or a duration."""
        return self.type in TIMES

    @property
    def is_message(self) -> bool:
        """Whether the field is a nested message."""
        return "/" in self.type


def fields_of(types: Typesdict, message_type: str) -> list[Field]:
    """Return the fields of a type in their order."""
    return [_field(name, desc) for name, desc in types[message_type][1]]


def as_dict(types: Typesdict, message_type: str, message: object) -> dict[str, Any]:
    """Return a deserialized message as dictionaries, lists and numbers, with times in nanoseconds."""
    return {field.name: plain(types, field, getattr(message, field.name)) for field in fields_of(types, message_type)}


def blank(store: Typestore, message_type: str) -> Any:
    """Return a message of zeros, empty text and empty sequences."""
    values: dict[str, Any] = {}
    for field in fields_of(store.fielddefs, message_type):
        if field.count != "one":
            if field.format:
                values[field.name] = np.zeros(field.length, field.format)
            else:
                single = "" if field.is_text else None
                values[field.name] = [
                    blank(store, field.type) if single is None else single for _ in range(field.length)
                ]
        elif field.format:
            values[field.name] = np.zeros((), field.format).item()
        else:
            values[field.name] = "" if field.is_text else blank(store, field.type)
    return store.types[message_type](**values)


def _field(name: str, desc: FieldDesc) -> Field:
    kind: int
    inner: Any
    kind, inner = desc
    count: Literal["one", "array", "sequence"] = "one"
    length = 0
    if kind == Nodetype.ARRAY:
        count = "array"
        (kind, inner), length = inner
    elif kind == Nodetype.SEQUENCE:
        count = "sequence"
        (kind, inner), _bound = inner
    field_type = str(inner if kind == Nodetype.NAME else inner[0])
    return Field(name, field_type, _FORMATS.get(field_type), count, length)


def plain(types: Typesdict, field: Field, value: Any) -> Any:
    """Return the value of a field of a deserialized message as in :func:`as_dict`."""
    if field.count != "one":
        if field.format:
            return value.tolist()
        single = Field(field.name, field.type, None, "one", 0)
        return [plain(types, single, element) for element in value]
    if field.is_time:
        return int(value.sec) * 10**9 + int(value.nanosec)
    if field.format or field.is_text:
        return value
    return as_dict(types, field.type, value)
