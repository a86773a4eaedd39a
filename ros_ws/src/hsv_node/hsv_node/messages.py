"""Message classes by name."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def message_class(name: str) -> Any:
    """Return the class of a message type such as ``"hsv_msgs/msg/VehicleState"``."""
    package, kind, message = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), message)
