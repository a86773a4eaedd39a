"""The Foxglove server: topics with their definitions, bytes as they came."""

import pytest
from live_clients import FoxgloveClient
from waiting import wait_until

from hsv.bags.definitions import definition
from hsv.bags.description import TOPICS, resolved
from hsv.pages.live.foxglove_server import FoxgloveServer

NAMES = {resolved(topic): kind for topic, kind in TOPICS.items()}


@pytest.fixture
def server():
    server = FoxgloveServer(0, NAMES, ["/hsv/actuator"])
    yield server
    server.close()


def test_topics_come_with_their_definitions_and_bytes(server, messages):
    client = FoxgloveClient(server.port)
    assert client.protocol == "foxglove.sdk.v1"
    assert {channel["topic"]: channel["schemaName"] for channel in client.channels.values()} == NAMES
    for channel in client.channels.values():
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        assert channel["schema"] == definition(channel["schemaName"])

    def subscribed():
        # A message that is sent before the subscription has come is nobody's.
        server.send("/clock", 0, b"first")
        return client.messages["/clock"]

    wait_until(subscribed)
    sent = [(topic, time, data) for topic, time, data in messages[:900] if topic != "clock"]
    for topic, time, data in sent:
        server.send(resolved(topic), time, data)
    wait_until(lambda: sum(len(kept) for topic, kept in client.messages.items() if topic != "/clock") == len(sent))
    for topic in NAMES:
        if topic != "/clock":
            assert client.messages[topic] == [(t, data) for name, t, data in sent if resolved(name) == topic]


def test_a_latched_topic_is_sent_to_a_client_that_comes_late_and_to_no_other(server):
    server.send("/hsv/actuator", 1, b"earlier run")
    server.start_run()
    sent = [(2, b"one"), (3, b"two")]
    for time, data in sent:
        server.send("/hsv/actuator", time, data)
    clients = []
    for _ in range(2):
        clients.append(FoxgloveClient(server.port))
        wait_until(lambda: len(clients[-1].messages["/hsv/actuator"]) == len(sent))
    server.send("/hsv/actuator", 4, b"three")
    for client in clients:
        wait_until(lambda client=client: client.messages["/hsv/actuator"][-1][0] == 4)
        assert client.messages["/hsv/actuator"] == [*sent, (4, b"three")]
