"""The messages of a short flight as the live node receives them."""

from __future__ import annotations

from pathlib import Path

import pytest
from recorded_flight import message_types, record_flight

from hsv.bags.description import TOPICS, resolved
from hsv.pages.layouts import foxglove_layout
from hsv.pages.live.hub import Hub
from hsv.pages.live.server import PageServer

Message = tuple[str, int, bytes]
"""Topic, simulated time (ns) and bytes of a message."""


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    """Return the bag of 4 s of Case 1, with the fault at 2 s."""
    return record_flight(tmp_path_factory.mktemp("bags") / "flown", duration=4.0, fault=2.0)


@pytest.fixture(scope="session")
def messages(bag):
    """Return all step messages, in the order in which the messages of a step are recorded."""
    by_time: dict[int, list[Message]] = {}
    for topic in TOPICS:
        for time, data in bag.messages(topic):
            by_time.setdefault(time, []).append((topic, time, data))
    return [message for time in sorted(by_time) for message in by_time[time]]


@pytest.fixture(scope="session")
def decode():
    types = message_types()
    return lambda topic, data: types.deserialize_cdr(data, TOPICS[topic])


@pytest.fixture
def hub(decode):
    hub = Hub(decode, {"title": "a flight", "bag": str(Path("bags", "flown"))})
    hub.start_run("1f" * 16, 0.02, 200)
    return hub


@pytest.fixture
def server(hub):
    server = PageServer(0, hub, foxglove_layout(resolved))
    yield server
    server.close()
