"""Locks on this machine for nodes, topics and namespaces of a ROS domain; and the ports of the live view.

A lock is an abstract Unix socket with the name of what it locks. Only one process can bind it, and the kernel releases
it when the process ends for whatever reason. A process takes its locks before it sends anything. Other machines of
the domain do not see the lock.
"""

from __future__ import annotations

import hashlib
import os
import re
import socket

from hsv.base.errors import ParameterError, reason

LAST_DOMAIN = 232
"""The highest domain whose ports are below 65536."""

HOST = "127.0.0.1"
"""The only address on which the servers of the live view accept connections."""


def ros_domain() -> int:
    """Return the ROS domain of this process (0 by default) after checking that nodes in it can find each other.

    Raises:
        ParameterError: ROS_DOMAIN_ID is not a decimal number up to :data:`LAST_DOMAIN`, without sign or leading zero
            (rcl would read 025 as octal, and -1 as 0), discovery is off, or the loopback network interface is down.
    """
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not re.fullmatch(r"0|[1-9][0-9]*", text) or int(text) > LAST_DOMAIN:
        raise ParameterError(f"ROS_DOMAIN_ID={text!r}: expected a whole number from 0 to {LAST_DOMAIN}")
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    if (value := os.environ.get(name, "")).upper() == "OFF":
        raise ParameterError(f"{name}={value!r}: expected LOCALHOST or SUBNET, so that the nodes find each other")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect((HOST, 9))
        except OSError:
            raise ParameterError("network interface lo: down, expected up, so that the nodes find each other") from None
    return int(text)


def claim(kind: str, domain: int, name: str) -> socket.socket | None:
    """Reserve a name for one process of this machine; return the open claim, or None if the name is taken.

    Args:
        kind: What is named: ``node``, ``topic``, or ``domain`` for the namespace of a run.
        domain: The ROS domain.
        name: Full name of the node, topic or namespace.
    """
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        held.bind(_address(kind, domain, name))
    except OSError:
        held.close()
        return None
    return held


def is_published(domain: int, topic: str) -> bool:
    """Return whether a node on this machine has claimed ``topic``, a full name."""
    # Binding the name as a test would make a node fail that claims the topic at the same instant.
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(_address("topic", domain, topic))
        except ConnectionRefusedError:
            return False
    return True


def _address(kind: str, domain: int, name: str) -> str:
    # Hashed because Linux limits the address to 107 bytes.
    return f"\0hsv_{kind}_{domain}_{hashlib.sha256(name.encode()).hexdigest()}"


def origins(port: int) -> list[str]:
    """Return the HTTP origins by which a browser may name the page served on ``port``."""
    return [f"http://{name}:{port}" for name in (HOST, "localhost")]


def ports(first: int) -> tuple[int, int]:
    """Return the ports of Foxglove's server and of the live page: ``first`` and the next one, or (0, 0) if it is 0.

    With port 0, a server takes any free port.

    Raises:
        ParameterError: A port is out of range or in use.
    """
    if not 0 <= first < 65535:
        raise ParameterError(f"live-port = {first}: expected 1 to 65534, or 0 for any free ones")
    chosen = (first, first + 1 if first else 0)
    for port in chosen:
        with socket.socket() as tried:
            # Like the servers, accept a port that another process has just closed.
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((HOST, port))
            except OSError as error:
                raise ParameterError(
                    f"live-port = {first}: port {port}: {reason(error).lower()}, expected two free ports, this and the "
                    "next, or 0 for any"
                ) from None
    return chosen
