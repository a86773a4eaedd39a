"""Message definitions and type hashes of the installed ROS 2 packages, found through the ament index."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path

from rosbags.typesys import TypesysError, get_types_from_msg

from hsv.bags.typestore import fields_of
from hsv.base.errors import RecordingError

SEPARATOR = "=" * 80


def definition(message_type: str) -> str:
    """Return the definition of a type with its dependencies, in the ``ros2msg`` format of MCAP.

    Args:
        message_type: ``package/msg/Type``; looked up as ``share/package/msg/Type.msg`` below each prefix of
            AMENT_PREFIX_PATH.

    Returns:
        The text of the type, then for each dependency a line of 80 ``=``, a line ``MSG: package/Type`` and its text.
        The name is without ``msg``, as in rosbag2, because Foxglove and Lichtblick look types up by the names in the
        fields.

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
    """Return the hash of a type (``RIHS01_`` and 64 digits) from its installed description."""
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
