"""The message types of a bag from its recorded definitions."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from hsv.bags.fields import TIMES, fields_of
from hsv.base.errors import RecordingError

MAX_SURPLUS = 64
"""Maximum number of bytes behind a message, besides three of padding."""


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


def deserialized(types: Typestore, message: bytes, message_type: str) -> Any:
    """Return a deserialized message.

    rosbags admits three bytes after a message. ``serialize_message`` of rmw_fastrtps leaves more, in steps of four,
    behind a message with empty sequences of numbers of eight bytes, such as the parameters of a fault without any.

    Raises:
        SerdeError: The message does not fit its definition.
    """
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
