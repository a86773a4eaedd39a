"""A ROS domain that no other process on this machine uses: no other test, no user, no process left over.

Domain d has the UDP ports from 7400 + 250 d on: two for discovery by multicast, then two for every participant
(DDSI-RTPS 2.5, section 9.6.2.3). A test claims a domain by binding the TCP port with the first of these numbers, which
DDS does not use. Only one process at a time can, and the port is free again however the process ends. In addition, all
UDP ports of the domain and the name that ``hsv run`` binds must be free, so that a domain with a flight is skipped.
Domain 100 is the last whose ports lie below 32768, where the ports begin that Linux assigns by itself. The low domains
are left to users, who choose them by hand.
"""

import os
import socket
from contextlib import ExitStack, contextmanager

DOMAINS = range(100, 40, -1)
PARTICIPANTS = 32
"""Maximum number of participants: more than two graphs and their listeners need."""


def first_port(domain):
    """Return the number of the first port of a ROS domain."""
    return 7400 + 250 * domain


@contextmanager
def own_domain():
    """Yield the number of a domain that no other process uses while the block runs.

    Raises:
        RuntimeError: All domains are taken.
    """
    for domain in DOMAINS:
        with ExitStack() as held:
            try:
                held.enter_context(_bound(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", first_port(domain))))
                look_for_others(domain)
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError(f"all ROS domains from {DOMAINS[-1]} to {DOMAINS[0]} are taken")


@contextmanager
def own_environment():
    """Yield an environment for processes on such a domain, limited to this machine."""
    with own_domain() as domain:
        yield os.environ | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def look_for_others(domain):
    """Raise an OSError if a participant or ``hsv run`` uses the domain."""
    with ExitStack() as tried:
        tried.enter_context(_bound(socket.AF_UNIX, socket.SOCK_DGRAM, f"\0hsv_domain_{domain}"))
        for port in range(first_port(domain) + 10, first_port(domain) + 10 + 2 * PARTICIPANTS):
            tried.enter_context(_bound(socket.AF_INET, socket.SOCK_DGRAM, ("", port)))


def _bound(family, kind, address):
    bound = socket.socket(family, kind)
    try:
        bound.bind(address)
    except OSError:
        bound.close()
        raise
    return bound
