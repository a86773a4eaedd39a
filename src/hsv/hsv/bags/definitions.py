"""Message definitions of the installed ROS 2 packages or of a bag, and the message types that they define."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from hsv.base.errors import RecordingError

SEPARATOR = "=" * 80
"""Line between the definitions of a type and of its dependencies."""
TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Types of a time and of a duration. Their fields, int32 sec and uint32 nanosec, are read as one number, in ns."""
_FORMATS = {"bool": "?", "byte": "u1", "char": "u1", "float32": "<f4", "float64": "<f8"} | {
    f"{sign}int{bits}": f"<{code}{bits // 8}" for sign, code in (("", "i"), ("u", "u")) for bits in (8, 16, 32, 64)
}

MAX_SURPLUS = 64
"""Maximum number of surplus bytes after the end of a message. ``serialize_message`` of rmw_fastrtps leaves up to eight
for every empty sequence of 8-byte numbers, such as the parameters of a fault that has none; DDS adds at most three."""


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message type."""

    name: str
    type: str
    """``package/msg/Type`` or the name of a base type."""
    format: str | None
    """numpy format of the number, or of an element of the array or sequence; None for texts and messages."""
    count: Literal["one", "array", "sequence"]
    length: int
    """Number of elements of an array; 0 otherwise."""

    @property
    def is_text(self) -> bool:
        """Whether the field is a text or a list of texts, bounded or unbounded, but not of wide characters."""
        return self.type == "string"

    @property
    def is_time(self) -> bool:
        """Whether the field is a time, a duration, or a list of these."""
        return self.type in TIMES

    @property
    def is_message(self) -> bool:
        """Whether the field is a nested message (a time is one, too) or a list of messages."""
        return "/" in self.type


def fields_of(types: Typesdict, message_type: str) -> list[Field]:
    """Return the fields of a message type in the order of its definition; ``types`` has the parsed definitions."""
    return [_field(name, desc) for name, desc in types[message_type][1]]


def as_dict(types: Typesdict, message_type: str, message: object) -> dict[str, Any]:
    """Return a deserialized message as a dictionary of plain data, see :func:`plain`; times are in nanoseconds."""
    return {field.name: plain(types, field, getattr(message, field.name)) for field in fields_of(types, message_type)}


def blank(store: Typestore, message_type: str) -> Any:
    """Return a new message of a type, with zeros, empty texts and empty sequences."""
    values: dict[str, Any] = {}
    for field in fields_of(store.fielddefs, message_type):
        size = 1 if field.count == "one" else field.length
        if field.format:
            zeros: Any = np.zeros(size, field.format)
        else:
            zeros = ["" if field.is_text else blank(store, field.type) for _ in range(size)]
        values[field.name] = zeros if field.count != "one" else zeros.item() if field.format else zeros[0]
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
    """Return the value of a message field as plain data: number, text, list or dictionary; a time in nanoseconds."""
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


def message_types(
    definitions: Sequence[tuple[str, str]], source: str, optional: Sequence[tuple[str, str]] = ()
) -> Typestore:
    """Return the message types of ``definitions``, with all their dependencies.

    Args:
        definitions: Name and text of each type, in the ``ros2msg`` format of MCAP.
        source: Source of the definitions, for error messages.
        optional: Further definitions; unusable ones are skipped.

    Raises:
        RecordingError: A definition cannot be parsed, contradicts another, or refers to an unknown type or to itself.
    """
    store = get_typestore(Stores.EMPTY)
    for name, text in definitions:
        _register(store, name, text, f"{source}: definition of {name}")
    for name, _ in definitions:
        _check(store, name, (), f"{source}: definition of {name}")
    for name, text in optional:
        with suppress(RecordingError, TypesysError):
            alone = get_typestore(Stores.EMPTY)
            _register(alone, name, text, source)
            _check(alone, name, (), source)
            store.register(alone.fielddefs)
    return store


@cache
def installed_types(message_type: str) -> Typestore:
    """Return the parsed definitions of an installed message type and its dependencies."""
    return message_types([(message_type, definition(message_type))], message_type)


def deserialized(types: Typestore, message: bytes, message_type: str) -> Any:
    """Return ``message`` (CDR) deserialized, ignoring a few surplus bytes at its end; raise a SerdeError if invalid."""
    try:
        return types.deserialize_cdr(message, message_type)
    except SerdeError:
        for surplus in range(4, min(MAX_SURPLUS, len(message)) + 1, 4):
            with suppress(SerdeError):
                return types.deserialize_cdr(message[:-surplus], message_type)
        raise


def _register(store: Typestore, name: str, text: str, where: str) -> None:
    try:
        store.register(get_types_from_msg(text, name))
    except TypesysError as error:
        raise RecordingError(f"{where}: {str(error).splitlines()[0]}") from None
    except Exception as error:
        # The library fails to compile some definitions that it parses, such as those with a list as a constant.
        raise RecordingError(f"{where}: cannot be used ({type(error).__name__})") from None


def _check(store: Typestore, name: str, within: tuple[str, ...], where: str) -> None:
    if name in within:
        raise RecordingError(f"{where}: {name} holds itself")
    if name not in store.fielddefs:
        raise RecordingError(f"{where}: unknown type {name}")
    for field in fields_of(store.fielddefs, name):
        if field.length < 0:
            raise RecordingError(f"{where}: field {field.name}: length {field.length}, expected a number not below 0")
        if field.is_message and field.type not in TIMES:
            _check(store, field.type, (*within, name), where)


def definition(message_type: str) -> str:
    """Return the installed definition of a message type with its dependencies, in the ``ros2msg`` format of MCAP.

    Args:
        message_type: ``package/msg/Type``; looked up as ``share/package/msg/Type.msg`` below each prefix of
            AMENT_PREFIX_PATH.

    Returns:
        The text of the type, then for each dependency a line of 80 ``=``, a line ``MSG: package/Type`` and its text.
        As in rosbag2, the names in the ``MSG:`` lines lack ``msg``, because Foxglove and Lichtblick look a type up
        under the name that the definition of a field uses for it.

    Raises:
        RecordingError: The type or one of its dependencies is not installed or cannot be read.
    """
    texts: dict[str, str] = {}
    waiting = [message_type]
    while waiting:
        name = waiting.pop(0)
        if name not in texts:
            texts[name], dependencies = _read(name, _share_file(name, ".msg"))
            waiting.extend(dependencies)
    root, *others = texts.items()
    parts = [f"\n{SEPARATOR}\nMSG: {name.replace('/msg/', '/')}\n{text}" for name, text in others]
    return "".join([root[1], *parts])


def type_hash(message_type: str) -> str:
    """Return the hash of a message type (``RIHS01_`` and 64 hexadecimal digits) from its installed description."""
    description = json.loads(_share_file(message_type, ".json").read_text(encoding="utf-8"))
    return next(str(row["hash_string"]) for row in description["type_hashes"] if row["type_name"] == message_type)


def _share_file(message_type: str, suffix: str) -> Path:
    parts = message_type.split("/")
    if len(parts) != 3:
        raise RecordingError(f"message type {message_type!r}: expected package/msg/Type")
    relative = Path("share", parts[0], parts[1], parts[2] + suffix)
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "")
    for prefix in filter(None, prefixes.split(os.pathsep)):
        if (path := Path(prefix, relative)).is_file():
            return path
    searched = prefixes or "not set"
    raise RecordingError(f"message type {message_type}: no {relative} below AMENT_PREFIX_PATH ({searched})")


@cache
def _read(message_type: str, path: Path) -> tuple[str, list[str]]:
    text = path.read_text(encoding="utf-8")
    try:
        fields = fields_of(get_types_from_msg(text, message_type), message_type)
    except TypesysError as error:
        raise RecordingError(f"message type {message_type}: {path} cannot be parsed: {error!r}") from None
    return text, [field.type for field in fields if field.is_message]
