"""The ports of both servers: of this machine only, and named where they are in use."""

import socket
from pathlib import Path

import pytest

from hsv.bags.description import TOPICS, resolved
from hsv.base.errors import ParameterError
from hsv.pages.live.foxglove_server import FoxgloveServer
from hsv.pages.live.server import PageServer


@pytest.fixture(params=["live.port", "live.page_port"])
def serve(request, hub):
    """Return the parameter that a server's port is, and what starts it on one."""
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
