"""The flight over the Foxglove WebSocket protocol: every topic with its definition, its messages as they came."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import foxglove

from hsv.bags.definitions import definition
from hsv.base.errors import ParameterError
from hsv.graph.addresses import HOST


class FoxgloveServer:
    """Serves topics to Foxglove and Lichtblick, to read only; a client that is slow misses messages, others do not."""

    def __init__(self, port: int, topics: Mapping[str, str]) -> None:
        """Start the server.

        Args:
            port: Port of this machine; 0: any free one.
            topics: Type of each topic, by its full name.

        Raises:
            ParameterError: The port is in use.
            RecordingError: A message type is not installed.
        """
        # Of a client that comes wrongly or leaves, a person at the flight need not hear.
        foxglove.set_log_level(logging.CRITICAL)
        # Kept: its channels close with it.
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
            self._server = foxglove.start_server(name="hsv", host=HOST, port=port, context=self._context)
        except RuntimeError:
            raise ParameterError(f"live.port = {port}: in use, expected a free port of this machine") from None

    @property
    def port(self) -> int:
        """The port of the server."""
        return self._server.port

    def send(self, topic: str, time: int, data: bytes) -> None:
        """Send a serialized message of simulated ``time`` (ns) to all subscribers of its topic."""
        self._channels[topic].log(data, log_time=time)

    def start_run(self) -> None:
        """Have the clients forget the run before."""
        self._server.clear_session()

    def close(self) -> None:
        """Leave the clients."""
        self._server.stop()
