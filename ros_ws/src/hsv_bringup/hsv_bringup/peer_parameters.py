"""Asking the other nodes of a graph for their parameters, by the services that every node has."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

from hsv.bags.description import COMPOSED
from hsv.graph.standstill import Standstill, processor_time_of

GIVE_UP_AFTER = 10.0
"""Time (s) without answers or processor time of the silent nodes after which the recorder stops waiting for them."""

_LOOK = 1.0
"""Time (s) between checks of the processes of this machine."""


class PeerParameters:
    """The parameters of other nodes, collected while the asking node continues."""

    def __init__(self, node: Node, names: Mapping[str, str]) -> None:
        """Start the requests.

        Args:
            node: Node that sends the requests.
            names: Full names of the other nodes by role, which is also the name of the executable.
        """
        self._peers = {role: _Peer(node, name) for role, name in names.items()}
        self._standstill = Standstill()
        self._looked = -_LOOK
        self.gave_up = False
        """Whether the wait for silent nodes has ended."""

    def silent(self) -> dict[str, str]:
        """Go on asking; return the service that has not answered yet, by role."""
        for peer in self._peers.values():
            peer.ask()
        silent = {role: peer.service for role, peer in self._peers.items() if peer.values is None}
        if silent and time.monotonic() - self._looked >= _LOOK:
            self._looked = time.monotonic()
            # A node that is still building its component answers later; it is busy all the while.
            progress = len(silent), processor_time_of((*silent, COMPOSED.executable))
            self.gave_up = self._standstill.look(progress) > GIVE_UP_AFTER
        return silent

    def values(self) -> dict[str, dict[str, Any]]:
        """Return the flat parameters of those that have answered, by role; without those that are not set."""
        return {role: peer.values for role, peer in self._peers.items() if peer.values is not None}

    def close(self) -> None:
        """Stop asking."""
        for peer in self._peers.values():
            peer.close()


class _Peer:
    """Requests to a node: first for the names of its parameters, then for their values."""

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._list = node.create_client(ListParameters, f"{name}/list_parameters")
        self._get = node.create_client(GetParameters, f"{name}/get_parameters")
        self._names: list[str] | None = None
        self._future: Future | None = None
        self.values: dict[str, Any] | None = None

    @property
    def service(self) -> str:
        """Name of the service whose reply is pending."""
        return str(self._client.service_name)

    @property
    def _client(self) -> Client:
        return self._list if self._names is None else self._get

    def ask(self) -> None:
        """Send the next request when its service is ready; store the answer when it has arrived."""
        if self.values is not None:
            return
        if self._future is None:
            if self._client.service_is_ready():
                request = ListParameters.Request() if self._names is None else GetParameters.Request(names=self._names)
                self._future = self._client.call_async(request)
        elif self._future.done():
            answer, self._future = self._future.result(), None
            if self._names is None:
                self._names = sorted(answer.result.names)
            else:
                self.values = {
                    name: value
                    for name, sent in zip(self._names, answer.values, strict=True)
                    if (value := _plain(parameter_value_to_python(sent))) is not None
                }

    def close(self) -> None:
        """Stop asking."""
        for client in (self._list, self._get):
            self._node.destroy_client(client)


def _plain(value: Any) -> Any:
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
