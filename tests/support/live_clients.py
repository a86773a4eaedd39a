"""Clients of the live view, on another WebSocket library than the servers': one for each of the two protocols."""

import json
import re
import struct
import threading
from collections import defaultdict

import numpy as np
from websocket import WebSocketException, create_connection

from hsv.bags.description import TOPICS, resolved

_MESSAGE = struct.Struct("<BIQ")
"""Of foxglove.sdk.v1: 1 for message data, number of the subscription, log time (ns); the message follows."""

LATER = 60.0
"""Seconds without anything at all after which a client gives up."""


class FoxgloveClient:
    """Subscribes every topic of a server that speaks ``foxglove.sdk.v1``, and keeps what comes until it is left."""

    def __init__(self, port, *, reads=True):
        self._socket = create_connection(f"ws://127.0.0.1:{port}", LATER, subprotocols=["foxglove.sdk.v1"])
        self.protocol = self._socket.getsubprotocol()
        self.channels = {}
        self.messages = defaultdict(list)
        """Log time (ns) and bytes, by topic."""
        self._thread = threading.Thread(target=self._read, daemon=True)
        while not self.channels:
            self._take(self._socket.recv())
        if reads:
            self._thread.start()

    def wait(self):
        """Wait until the server has left."""
        self._thread.join()

    def leave(self):
        """Leave without a word."""
        self._socket.sock.close()

    def _read(self):
        try:
            while data := self._socket.recv():
                self._take(data)
        except (WebSocketException, OSError):
            pass  # the server has left

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
    """Does what the page does: gathers rows and status, asks, and waits for the answers."""

    def __init__(self, url, *, origin="", token=None):
        """Connect to the page of an address as the start prints it; without an ``origin``, as that page itself."""
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
        """All rows, one after the other."""
        return b"".join(self._blocks)

    def times(self, columns):
        """Return the times (s) of the rows, of so many columns beside the time."""
        return np.frombuffer(self.data, "<f4").reshape(-1, 1 + columns)[:, 0]

    def read(self):
        """Take the next message; return whether there was one."""
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
        """Return the answer to a command."""
        return self.send(json.dumps({"id": 1, "token": self.token, "command": command, **fields}))

    def send(self, text):
        """Return the answer to a request, whatever it is."""
        self._socket.send(text)
        before = len(self.answers)
        while len(self.answers) == before:
            assert self.read(), "the server has left"
        return self.answers[-1]

    def leave(self):
        """Leave without a word."""
        self._socket.sock.close()


def addresses(text):
    """Return the address of the page and the port for Foxglove, of what the start has printed."""
    page, data = re.search(r"live page: (\S+)", text), re.search(r"live data: ws://127\.0\.0\.1:(\d+)", text)
    assert page and data, text
    return page[1], int(data[1])


def assert_as_recorded(client, bag):
    """Every step topic has messages of the bag, byte by byte and in its order; a client that is slow may miss some."""
    for topic in TOPICS:
        received = client.messages[resolved(topic)]
        recorded = dict(bag.messages(topic))
        stamps = [stamp for stamp, _ in received]
        assert received and stamps == sorted(set(stamps)), topic
        assert all(recorded[stamp] == data for stamp, data in received), topic


def assert_without_gap(client, bag):
    """Every step topic has what the bag has, byte by byte, from the time on at which the client was there."""
    for topic in TOPICS:
        recorded = list(bag.messages(topic))
        received = client.messages[resolved(topic)]
        # Nobody waits for a client: on a busy machine the flight may have begun before it.
        assert len(received) > len(recorded) // 2, topic
        assert received == recorded[-len(received) :], topic
