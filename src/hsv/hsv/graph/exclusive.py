"""What there may be only one of in a ROS domain: a run in a namespace, a node that publishes a topic.

Each is a name that one process of this machine can bind, an abstract socket: taken at once, before the second has sent
anything, and free as soon as its process is gone, however that ended. On other machines of the same domain nothing is
known of it.
"""

from __future__ import annotations

import hashlib
import os
import socket

from hsv.errors import ParameterError

_LONGEST_NAME = 100
"""Bytes; the system takes 107."""


def ros_domain() -> int:
    """Return the ROS domain of this process.

    Raises:
        ParameterError: ROS_DOMAIN_ID is no number.
    """
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    try:
        return int(text)
    except ValueError:
        raise ParameterError(f"ROS_DOMAIN_ID={text!r}: expected a whole number") from None


def claim_namespace(domain: int, namespace: str) -> socket.socket | None:
    """Return what keeps a namespace of ``domain`` to one run while it is open; None if another run has it."""
    # The root namespace is the domain itself.
    return _bound(f"hsv_domain_{domain}", namespace.rstrip("/"))


def claim_topic(domain: int, topic: str) -> socket.socket | None:
    """Return what keeps ``topic`` (its full name) to one publisher while it is open; None if another node has it."""
    return _bound(f"hsv_topic_{domain}", topic)


def is_published(domain: int, topic: str) -> bool:
    """Tell whether a node of this machine has claimed ``topic``."""
    held = claim_topic(domain, topic)
    if held is None:
        return True
    held.close()
    return False


def _bound(kind: str, name: str) -> socket.socket | None:
    text = kind + name
    if len(text) > _LONGEST_NAME:
        text = f"{kind}_{hashlib.sha256(name.encode()).hexdigest()}"
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        held.bind(f"\0{text}")
    except OSError:
        held.close()
        return None
    return held
