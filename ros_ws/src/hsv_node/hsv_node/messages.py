"""Message classes by name."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def message_class(name: str) -> Any:
    """Return the class of a message type such as ``"hsv_msgs/msg/VehicleState"``."""
    package, kind, message = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), message)


def type_name(kind: type) -> str:
    """Return the type of a class of messages or of a service, such as ``"hsv_msgs/srv/InjectFault"``."""
    package, section, _ = kind.__module__.split(".")
    return f"{package}/{section}/{kind.__name__}"
