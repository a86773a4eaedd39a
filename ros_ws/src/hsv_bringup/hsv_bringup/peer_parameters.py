"""Requests for the parameters of other nodes, through the parameter services that every node has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from hsv_node.middleware import ServiceCall


class PeerParameters:
    """The parameters of other nodes, requested without blocking the requesting node."""

    def __init__(self, node: Node, names: Mapping[str, str]) -> None:
        """Request the parameter names of other nodes; ``names`` are the full names of these nodes by role."""
        self._node, self._names = node, names
        self._calls = {
            role: ServiceCall(node, ListParameters, f"{name}/list_parameters", ListParameters.Request())
            for role, name in names.items()
        }
        self._listed: dict[str, list[str]] = {}
        self.values: dict[str, dict[str, Any]] = {}
        """Parameters that have a value, by role of the node and name of the parameter, for nodes that have answered."""

    def silent(self) -> dict[str, str]:
        """Handle new answers and send the next requests; return the names of unanswered services, by role of node."""
        for role, name in self._names.items():
            if role in self.values or not (response := self._calls[role].response()):
                continue
            self._calls[role].close()
            if role not in self._listed:
                self._listed[role] = listed = sorted(response.result.names)
                request = GetParameters.Request(names=listed)
                self._calls[role] = ServiceCall(self._node, GetParameters, f"{name}/get_parameters", request)
            else:
                values = [parameter_value_to_python(value) for value in response.values]
                found = zip(self._listed[role], values, strict=True)
                self.values[role] = {name: _plain(value) for name, value in found if value is not None}
        return {role: call.name for role, call in self._calls.items() if role not in self.values}


def _plain(value: Any) -> Any:
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
