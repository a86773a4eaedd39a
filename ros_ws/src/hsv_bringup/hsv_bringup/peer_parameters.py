"""Asking the other nodes of a graph for their parameters, by the services that every node has."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from hsv.bags.description import COMPOSED
from hsv.graph.standstill import Standstill, processor_time_of
from hsv_node.middleware import ServiceCall

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
        self._node, self._name = node, name
        self._call = ServiceCall(node, ListParameters, f"{name}/list_parameters", ListParameters.Request())
        self._names: list[str] | None = None
        self.values: dict[str, Any] | None = None

    @property
    def service(self) -> str:
        """Name of the service whose reply is pending."""
        return self._call.name

    def ask(self) -> None:
        """Take the response if it has arrived, and send the next request."""
        if self.values is not None or not (response := self._call.response()):
            return
        if self._names is None:
            self.close()
            self._names = sorted(response.result.names)
            request = GetParameters.Request(names=self._names)
            self._call = ServiceCall(self._node, GetParameters, f"{self._name}/get_parameters", request)
            return
        found = zip(self._names, map(parameter_value_to_python, response.values), strict=True)
        self.values = {name: _plain(value) for name, value in found if value is not None}

    def close(self) -> None:
        """Stop asking."""
        self._call.close()


def _plain(value: Any) -> Any:
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
