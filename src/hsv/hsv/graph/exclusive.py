"""Exclusive roles: in a ROS domain, one run per namespace and one publisher per topic; one flight per processor.

Each is a name that one process of this machine can bind, an abstract socket: taken at once, before the second has sent
anything, and free as soon as its process is gone, however that ended. On other machines of the same domain nothing is
known of it.
"""

from __future__ import annotations

import hashlib
import os
import re
import socket

from hsv.base.errors import ParameterError

LAST_DOMAIN = 232
"""The highest domain whose ports are below 65536."""

_LONGEST_NAME = 100
"""Bytes; the system takes 107."""


def ros_domain() -> int:
    """Return the ROS domain of this process, in which nodes can find each other.

    Raises:
        ParameterError: ROS_DOMAIN_ID is not such a number (rcl would read 025 as an octal one, and -1 as 0), discovery
            is switched off, or there is no network.
    """
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not re.fullmatch(r"0|[1-9][0-9]*", text) or int(text) > LAST_DOMAIN:
        raise ParameterError(f"ROS_DOMAIN_ID={text!r}: expected a whole number from 0 to {LAST_DOMAIN}")
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    if (value := os.environ.get(name, "")).upper() == "OFF":
        raise ParameterError(f"{name}={value!r}: expected LOCALHOST or SUBNET, so that the nodes find each other")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(("127.0.0.1", 9))
        except OSError:
            raise ParameterError("network interface lo: down, expected up, so that the nodes find each other") from None
    return int(text)


def claim_namespace(domain: int, namespace: str) -> socket.socket | None:
    """Return what keeps a namespace of ``domain`` to one run while it is open; None if another run has it."""
    # The root namespace is the domain itself.
    return _bound("hsv_domain", domain, namespace.rstrip("/"))


def claim_topic(domain: int, topic: str) -> socket.socket | None:
    """Return what keeps ``topic`` (its full name) to one publisher while it is open; None if another node has it."""
    return _bound("hsv_topic", domain, topic)


def claim_node(domain: int, name: str) -> socket.socket | None:
    """Return what keeps the full ``name`` of a node to one process while it is open; None if another node has it."""
    return _bound("hsv_node", domain, name)


def is_published(domain: int, topic: str) -> bool:
    """Tell whether a node of this machine has claimed ``topic``."""
    # To bind it would refuse a node that claims it in the same instant.
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(_address("hsv_topic", domain, topic))
        except ConnectionRefusedError:
            return False
    return True


def _address(kind: str, number: int, name: str) -> str:
    text = f"{kind}_{number}{name}"
    if len(text) > _LONGEST_NAME:
        text = f"{kind}_{number}_{hashlib.sha256(name.encode()).hexdigest()}"
    return f"\0{text}"


def _bound(kind: str, number: int, name: str) -> socket.socket | None:
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        held.bind(_address(kind, number, name))
    except OSError:
        held.close()
        return None
    return held
