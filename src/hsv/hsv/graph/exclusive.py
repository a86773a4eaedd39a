"""Locks of this machine: nodes, topics and run namespaces of a ROS domain, and ports, each held by one process.

A lock is an abstract socket with the name of what it locks. Only one process can bind it, before it sends anything, and
the kernel releases it when the process ends for whatever reason. Other machines of the domain do not see the lock.
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
            asking.connect((HOST, 9))
        except OSError:
            raise ParameterError("network interface lo: down, expected up, so that the nodes find each other") from None
    return int(text)


def claim(kind: str, domain: int, name: str) -> socket.socket | None:
    """Reserve a name for one process of this machine; return the open claim, or None if another process has it.

    Args:
        kind: ``node``, ``topic``, or ``domain`` for a namespace, which belongs to one run.
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
    """Tell whether a node of this machine has claimed ``topic``."""
    # To bind it would refuse a node that claims it in the same instant.
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(_address("topic", domain, topic))
        except ConnectionRefusedError:
            return False
    return True


def _address(kind: str, domain: int, name: str) -> str:
    # The system takes 107 bytes.
    return f"\0hsv_{kind}_{domain}_{hashlib.sha256(name.encode()).hexdigest()}"


def origins(port: int) -> list[str]:
    """Return the origins of the page that is served on ``port``, as browsers name them."""
    return [f"http://{name}:{port}" for name in (HOST, "localhost")]


def ports(first: int) -> tuple[int, int]:
    """Return the ports of Foxglove's server and of the page: ``first`` and the next one, or with 0 any two free ones.

    Raises:
        ParameterError: One of them is none, or in use.
    """
    if not 0 <= first < 65535:
        raise ParameterError(f"live-port = {first}: expected 1 to 65534, or 0 for any free ones")
    chosen = (first, first + 1 if first else 0)
    for port in chosen:
        with socket.socket() as tried:
            # What has just been left is free: the servers take it, too.
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((HOST, port))
            except OSError as error:
                raise ParameterError(
                    f"live-port = {first}: port {port}: {reason(error).lower()}, expected two free ports, this and the "
                    "next, or 0 for any"
                ) from None
    return chosen
