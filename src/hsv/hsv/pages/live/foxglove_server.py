"""Server of the Foxglove WebSocket protocol: all topics with their definitions and unchanged messages."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping

import foxglove
from foxglove.websocket import ChannelView, Client, ServerListener

from hsv.bags.definitions import definition
from hsv.base.errors import ParameterError
from hsv.graph.exclusive import HOST


class FoxgloveServer(ServerListener):
    """A read-only server of topics for Foxglove and Lichtblick; a slow client misses messages but delays no others."""

    def __init__(self, port: int, topics: Mapping[str, str], latched: Iterable[str] = ()) -> None:
        """Serve ``topics``, message types by full topic name, on ``port`` of this machine; 0 is any free port.

        Late subscribers of ``latched`` topics also receive the earlier messages. A ParameterError names a port in use.
        """
        # Suppress messages about clients that connect and disconnect.
        foxglove.set_log_level(logging.CRITICAL)
        self._latched: dict[str, list[tuple[int, bytes]]] = {topic: [] for topic in latched}
        """Time (ns) and bytes of all messages of this run, by latched topic."""
        # Keep the context, because its channels are closed with it.
        self._context = foxglove.Context()
        self._channels = {
            name: foxglove.Channel(
                name,
                message_encoding="cdr",
                schema=foxglove.Schema(name=kind, encoding="ros2msg", data=definition(kind).encode()),
                context=self._context,
            )
            for name, kind in topics.items()
        }
        try:
            self._server = foxglove.start_server(
                name="hsv", host=HOST, port=port, context=self._context, server_listener=self
            )
        except RuntimeError:
            raise ParameterError(f"live.port = {port}: in use, expected a free port of this machine") from None

    @property
    def port(self) -> int:
        """Port of the server."""
        return self._server.port

    def send(self, topic: str, time: int, data: bytes) -> None:
        """Send a serialized message of simulated ``time`` (ns) to all subscribers of its topic."""
        if topic in self._latched:
            self._latched[topic].append((time, data))
        self._channels[topic].log(data, log_time=time)

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Send the earlier messages of a latched topic to a client that subscribes."""
        for time, data in list(self._latched.get(channel.topic, ())):
            self._channels[channel.topic].log(data, log_time=time, sink_id=client.id)

    def start_run(self) -> None:
        """Discard the messages of the previous run, here and in the clients."""
        for messages in self._latched.values():
            messages.clear()
        self._server.clear_session()

    def close(self) -> None:
        """Stop the server and disconnect the clients."""
        self._server.stop()
