"""The domains that tests fly in are nobody else's."""

from __future__ import annotations

import socket

import pytest
from ros_domain import DOMAINS, first_port, look_for_others, own_domain


def test_domains_held_at_once_differ() -> None:
    with own_domain() as first, own_domain() as second:
        assert first != second and {first, second} <= set(DOMAINS)


def test_a_domain_with_a_participant_or_a_run_is_somebody_elses() -> None:
    with own_domain() as domain:
        look_for_others(domain)
        for family, address in (
            (socket.AF_INET, ("127.0.0.1", first_port(domain) + 12)),
            (socket.AF_UNIX, f"\0hsv_domain_{domain}"),
        ):
            with socket.socket(family, socket.SOCK_DGRAM) as other:
                other.bind(address)
                with pytest.raises(OSError, match="in use"):
                    look_for_others(domain)


def test_all_ports_lie_below_those_that_the_system_hands_out() -> None:
    assert max(map(first_port, DOMAINS)) + 250 < 32768
