"""The middleware: quality of service, message classes by name, calls of services, and settings of Fast DDS."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping
from importlib import import_module
from pathlib import Path
from typing import Any

from hsv_msgs.msg import Fault
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from hsv.base.errors import RecordingError

STEP = QoSProfile(depth=256, reliability=ReliabilityPolicy.RELIABLE)
"""Quality of service of the step topics; the queue exceeds the steps by which the plant may lead the recorder."""

LATCHED = QoSProfile(depth=32, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Quality of service of announcements, which late subscribers must receive."""

LATEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Quality of service of a viewer of the latest message: publishers do not wait for it, and it may miss messages."""

PROFILES = Path(__file__).with_name("fastdds.xml")
"""Settings file of Fast DDS: how often a new node announces itself, and how long repeats are suppressed."""

_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")


def message_class(name: str) -> Any:
    """Return the class of a message type such as ``"hsv_msgs/msg/VehicleState"``."""
    package, kind, message = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), message)


def installed_class(topic: str, kind: str) -> Any:
    """Return the class of the message type ``kind`` of ``topic``.

    Raises:
        RecordingError: The type is not installed; the message names ``topic``.
    """
    try:
        return message_class(kind)
    except (ImportError, AttributeError, ValueError):
        raise RecordingError(f"topic {topic}: message type {kind} is not installed") from None


def fault_message(channel: str, type: str, parameters: Mapping[str, float]) -> Fault:
    """Return a fault as a message; ``parameters`` are SI values by name."""
    return Fault(
        channel=channel, type=type, parameter_names=list(parameters), parameter_values=list(parameters.values())
    )


def type_name(kind: type) -> str:
    """Return the type name of a message or service class, such as ``"hsv_msgs/srv/InjectFault"``."""
    package, section, _ = kind.__module__.split(".")
    return f"{package}/{section}/{kind.__name__}"


class ServiceCall:
    """A request that is sent when the service is ready; the node goes on meanwhile and polls :meth:`response`."""

    def __init__(self, node: Node, kind: Any, name: str, request: Any) -> None:
        self.name = name
        self._node, self._request = node, request
        self._client = node.create_client(kind, name)
        self._future: Future | None = None

    @property
    def sent(self) -> bool:
        """Whether the request has been sent."""
        return self._future is not None

    def response(self) -> Any:
        """Send the request if the service has become ready; return the response, or None if it has not arrived."""
        if self._future is not None:
            return self._future.result() if self._future.done() else None
        if self._client.service_is_ready():
            self._future = self._client.call_async(self._request)
        return None

    def close(self) -> None:
        """Destroy the client."""
        self._node.destroy_client(self._client)


def prefer_profiles(environment: MutableMapping[str, str] = os.environ, directory: Path | None = None) -> None:
    """Make Fast DDS read :data:`PROFILES`; call it before the first node is created.

    A file that the ``environment`` names, or that Fast DDS finds in the working ``directory``, has precedence.
    """
    own = Path(directory or "", "DEFAULT_FASTRTPS_PROFILES.xml")
    if not any(name in environment for name in _VARIABLES) and not own.exists():
        environment[_VARIABLES[0]] = str(PROFILES)
