"""A ROS domain that nobody else on this machine has: not other tests, not a user, not a process left over.

Domain d has the UDP ports from 7400 + 250 d on: two for discovery by multicast, then two for every participant
(DDSI-RTPS 2.5, section 9.6.2.3). A test takes the domain by binding the TCP port of the first number, which DDS does
not use: one process at a time can, and it is free again however that process ends. Besides, the UDP ports of the domain
must all be free, and the name that ``hsv run`` binds: a domain in which somebody flies is passed over. Domain 100 is
the last whose ports lie below those that Linux hands out by itself, from 32768 on; the low domains are left to people,
who choose them by hand.
"""

import os
import socket
from contextlib import ExitStack, contextmanager

DOMAINS = range(100, 40, -1)
PARTICIPANTS = 32
"""More than two graphs with all that listen to them."""


def first_port(domain):
    """Return the first of the ports of a ROS domain."""
    return 7400 + 250 * domain


@contextmanager
def own_domain():
    """Yield the number of a domain that is nobody else's while the block runs.

    Raises:
        RuntimeError: All are taken.
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
    """Yield the environment of processes on such a domain, on this machine only."""
    with own_domain() as domain:
        yield os.environ | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def look_for_others(domain):
    """Raise an OSError if a participant or ``hsv run`` is on the domain."""
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
