"""The servers for the page and for Foxglove: ports, access, data, commands, and clients that do not read."""

import asyncio
import json
import socket
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from live_clients import FoxgloveClient, PageClient
from waiting import wait_until
from websocket import WebSocketBadStatusException

from hsv.bags.definitions import definition
from hsv.bags.description import TOPICS, resolved
from hsv.base.errors import ParameterError
from hsv.pages.live.commands import Clear
from hsv.pages.live.foxglove_server import FoxgloveServer
from hsv.pages.live.server import LONGEST_REQUEST, MAX_WAITING, PageServer
from hsv.pages.panels import LIVE_CURVES

A_STEP = 9


def get(server, path="/", **headers):
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request) as response:
            return response.status, response.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def fly(hub, server, messages):
    for number, message in enumerate(messages, 1):
        hub.offer(*message)
        if number % A_STEP == 0:
            hub.sample()


def rows(client, hub, count):
    """Receive messages until ``count`` rows have arrived, and return the rows."""
    width = 4 * (1 + len(LIVE_CURVES))
    while len(client.data) < count * width:
        assert client.read()
    assert len(client.data) == count * width
    return client.times(len(LIVE_CURVES))


def test_the_page_is_whole_and_may_ask_its_own_server_only(server):
    assert {listening.getsockname()[0] for listening in server._server.sockets} == {"127.0.0.1"}
    status, page = get(server)
    assert status == 200 and "a flight" in page
    policy = page.partition('Content-Security-Policy" content="')[2].partition('"')[0]
    assert f"connect-src ws://127.0.0.1:{server.port} ws://localhost:{server.port}" in policy
    assert policy.startswith("default-src 'none'")
    assert server.url.rpartition("#token=")[2] not in page
    status, layout = get(server, "/foxglove.json")
    assert status == 200 and "/hsv/state.altitude" in layout and json.loads(layout)["layout"]
    assert get(server, "/etc/passwd") == (404, "path = '/etc/passwd': expected /, /foxglove.json or /flight\n")


def test_pages_of_other_places_are_refused(server):
    with pytest.raises(WebSocketBadStatusException) as refused:
        PageClient(server.url, origin="http://elsewhere.example")
    assert refused.value.status_code == 403
    expected = f"http://127.0.0.1:{server.port} or http://localhost:{server.port}"
    assert refused.value.resp_body.decode() == f"Origin: 'http://elsewhere.example', expected {expected}\n"
    assert get(server, "/", Origin="http://elsewhere.example")[0] == 403
    with pytest.raises(WebSocketBadStatusException) as refused:
        PageClient(server.url, origin=None)
    assert refused.value.resp_body.decode() == f"Origin: missing, expected {expected}\n"


def test_commands_need_the_token(hub, server):
    client = PageClient(server.url, token="guessed")
    answer = client.ask("clear")
    assert answer["accepted"] is False
    assert answer["message"].startswith("token: wrong or missing, expected that of the address")
    assert server.commands.empty()
    client = PageClient(server.url)
    client._socket.send(json.dumps({"token": client.token, "command": "clear", "id": 7}))
    wait_until(lambda: not server.commands.empty(), pause=lambda _: None)
    command, answered = server.commands.get()
    assert command == Clear("", "")
    answered({"accepted": True, "message": "done", "step": 3})
    while not client.answers:
        client.read()
    assert client.answers == [{"id": 7, "accepted": True, "message": "done", "step": 3}]


@pytest.mark.parametrize(
    ("request_text", "words"),
    [
        ("no json", "request: no JSON"),
        ("[1, 2]", "request = '[1, 2]': expected a JSON object"),
        ('{"id": ' + "[" * 4000 + "]" * 4000 + "}", "request: no JSON"),
        ('{"token": "\\ud800", "command": "pause"}', "half a surrogate pair"),
        ('{"command": "\\udfff\\ud800"}', "half a surrogate pair"),
    ],
)
def test_nonsense_is_answered(server, request_text, words):
    answer = PageClient(server.url).send(request_text)
    assert answer["accepted"] is False and words in answer["message"]


def test_whoever_comes_late_gets_all_and_then_what_is_new(hub, server, messages):
    early = PageClient(server.url)
    fly(hub, server, messages[: 100 * A_STEP])
    late = PageClient(server.url)
    first = rows(late, hub, 100)
    fly(hub, server, messages[100 * A_STEP :])
    assert rows(late, hub, 201)[:100].tolist() == first.tolist()
    assert rows(early, hub, 201).tolist() == late.times(len(LIVE_CURVES)).tolist()
    assert late.status["title"] == "a flight" and late.status["run"]["last_step"] == 200


@pytest.fixture(params=["live.port", "live.page_port"])
def serve(request, hub):
    """Return the name of a server's port parameter, and a function that starts the server on a port."""
    if request.param == "live.page_port":
        return request.param, lambda port: PageServer(port, hub, "{}")
    return request.param, lambda port: FoxgloveServer(port, {resolved(topic): kind for topic, kind in TOPICS.items()})


def test_it_listens_on_this_machine_only(serve):
    server = serve[1](0)
    port = server.port
    tables = "".join(Path("/proc/net", name).read_text() for name in ("tcp", "tcp6"))
    listening = [line.split() for line in tables.splitlines()]
    places = [words[1] for words in listening if words[1].endswith(f":{port:04X}") and words[3] == "0A"]
    server.close()
    assert places == [f"0100007F:{port:04X}"]


def test_a_port_in_use_is_named(serve):
    name, start = serve
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = held.getsockname()[1]
        expected = rf"^{name} = {port}: .*in use, expected a free port of this machine$"
        with pytest.raises(ParameterError, match=expected):
            start(port)


NAMES = {resolved(topic): kind for topic, kind in TOPICS.items()}


@pytest.fixture
def foxglove():
    server = FoxgloveServer(0, NAMES, ["/hsv/actuator"])
    yield server
    server.close()


def test_topics_come_with_their_definitions_and_bytes(foxglove, messages):
    client = FoxgloveClient(foxglove.port)
    assert client.protocol == "foxglove.sdk.v1"
    assert {channel["topic"]: channel["schemaName"] for channel in client.channels.values()} == NAMES
    for channel in client.channels.values():
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        assert channel["schema"] == definition(channel["schemaName"])

    def subscribed():
        # The server discards messages until it has registered the subscription, so the test repeats the message.
        foxglove.send("/clock", 0, b"first")
        return client.messages["/clock"]

    wait_until(subscribed)
    sent = [(topic, time, data) for topic, time, data in messages[:900] if topic != "clock"]
    for topic, time, data in sent:
        foxglove.send(resolved(topic), time, data)
    wait_until(lambda: sum(len(kept) for topic, kept in client.messages.items() if topic != "/clock") == len(sent))
    for topic in NAMES:
        if topic != "/clock":
            assert client.messages[topic] == [(t, data) for name, t, data in sent if resolved(name) == topic]


def test_a_latched_topic_is_sent_to_a_client_that_comes_late_and_to_no_other(foxglove):
    foxglove.send("/hsv/actuator", 1, b"earlier run")
    foxglove.start_run()
    sent = [(2, b"one"), (3, b"two")]
    for time, data in sent:
        foxglove.send("/hsv/actuator", time, data)
    clients = []
    for _ in range(2):
        clients.append(FoxgloveClient(foxglove.port))
        wait_until(lambda: len(clients[-1].messages["/hsv/actuator"]) == len(sent))
    foxglove.send("/hsv/actuator", 4, b"three")
    for client in clients:
        wait_until(lambda client=client: client.messages["/hsv/actuator"][-1][0] == 4)
        assert client.messages["/hsv/actuator"] == [*sent, (4, b"three")]


def test_what_waits_for_a_client_that_never_reads_is_bounded(server):
    client = PageClient(server.url)
    words = "x" * (LONGEST_REQUEST - 100)
    for _ in range(3 * MAX_WAITING):
        client._socket.send(json.dumps({"token": client.token, "command": words}))
    other = PageClient(server.url)
    assert other.ask("land")["accepted"] is False  # by then most requests of the first client are read
    assert len(asyncio.all_tasks(server._loop)) < MAX_WAITING + 30
