"""Clients of the live view for both of its protocols, with another WebSocket library than the server's."""

import json
import re
import struct
import threading
from collections import defaultdict

import numpy as np
from websocket import WebSocketException, create_connection

from hsv.bags.description import TOPICS, resolved

_MESSAGE = struct.Struct("<BIQ")
"""Head of a foxglove.sdk.v1 message: 1 for message data, number of the subscription, log time (ns)."""

LATER = 60.0
"""Seconds without data after which a client gives up."""


class FoxgloveClient:
    """A client that subscribes to every topic of a ``foxglove.sdk.v1`` server and keeps all messages."""

    def __init__(self, port, *, reads=True):
        self._socket = create_connection(f"ws://127.0.0.1:{port}", LATER, subprotocols=["foxglove.sdk.v1"])
        self.protocol = self._socket.getsubprotocol()
        self.channels = {}
        self.messages = defaultdict(list)
        """Log times (ns) and bytes of the messages by topic."""
        self._thread = threading.Thread(target=self._read, daemon=True)
        while not self.channels:
            self._take(self._socket.recv())
        if reads:
            self._thread.start()

    def wait(self):
        """Wait until the server has closed the connection."""
        self._thread.join()

    def leave(self):
        """Close the socket without a closing handshake."""
        self._socket.sock.close()

    def _read(self):
        try:
            while data := self._socket.recv():
                self._take(data)
        except (WebSocketException, OSError):
            pass  # the server has closed the connection

    def _take(self, data):
        if isinstance(data, bytes):
            kind, number, time = _MESSAGE.unpack_from(data)
            if kind == 1:
                self.messages[self.channels[number]["topic"]].append((time, data[_MESSAGE.size :]))
            return
        said = json.loads(data)
        if said["op"] == "advertise":
            self.channels |= {channel["id"]: channel for channel in said["channels"]}
            wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in said["channels"]]
            self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


class PageClient:
    """A client that acts as the live page does: it collects rows and status, sends commands and waits for answers."""

    def __init__(self, url, *, origin="", token=None):
        """Connect to the page at the printed address; an empty ``origin`` means that of the page itself."""
        found = re.fullmatch(r"(http://([^/]+))/#token=(.+)", url)
        assert found, url
        self.token = found[3] if token is None else token
        self._socket = create_connection(
            f"ws://{found[2]}/flight",
            LATER,
            origin=found[1] if origin == "" else origin,
            suppress_origin=origin is None,
        )
        self.status = {}
        self._blocks = []
        self.answers = []

    @property
    def data(self):
        """The bytes of all rows received so far."""
        return b"".join(self._blocks)

    def times(self, columns):
        """Return the times (s) of all rows; a row has the time and ``columns`` more numbers."""
        return np.frombuffer(self.data, "<f4").reshape(-1, 1 + columns)[:, 0]

    def read(self):
        """Receive the next message; return False if the connection is closed."""
        try:
            data = self._socket.recv()
        except (WebSocketException, OSError):
            return False
        if isinstance(data, bytes):
            self._blocks.append(data)
        elif not data:
            return False
        else:
            said = json.loads(data)
            match said.pop("kind"):
                case "history":
                    self._blocks.clear()
                case "status":
                    self.status = said
                case "answer":
                    self.answers.append(said)
        return True

    def ask(self, command, **fields):
        """Send a command and return the answer to it."""
        return self.send(json.dumps({"id": 1, "token": self.token, "command": command, **fields}))

    def send(self, text):
        """Send any text and return the answer to it."""
        self._socket.send(text)
        before = len(self.answers)
        while len(self.answers) == before:
            assert self.read(), "the server has left"
        return self.answers[-1]

    def leave(self):
        """Close the socket without a closing handshake."""
        self._socket.sock.close()


def addresses(text):
    """Return the page's address and the Foxglove port from the printed text."""
    page, data = re.search(r"live page: (\S+)", text), re.search(r"live data: ws://127\.0\.0\.1:(\d+)", text)
    assert page and data, text
    return page[1], int(data[1])


def assert_as_recorded(client, bag):
    """Assert that the messages of every step topic are in the bag, byte for byte and in order; some may be missing."""
    for topic in TOPICS:
        received = client.messages[resolved(topic)]
        recorded = dict(bag.messages(topic))
        stamps = [stamp for stamp, _ in received]
        assert received and stamps == sorted(set(stamps)), topic
        assert all(recorded[stamp] == data for stamp, data in received), topic


def assert_without_gap(client, bag):
    """Assert that every step topic has all messages of the bag, byte for byte, from the client's first one on."""
    for topic in TOPICS:
        recorded = list(bag.messages(topic))
        received = client.messages[resolved(topic)]
        # The flight does not wait for a client, so on a busy machine it may have begun earlier.
        assert len(received) > len(recorded) // 2, topic
        assert received == recorded[-len(received) :], topic
