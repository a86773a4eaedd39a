"""A node that is a process of its own: what :func:`hsv_node.main.run_node` runs."""

from __future__ import annotations

import socket
from typing import Any, ClassVar

from rclpy.node import Node

from hsv.base.errors import RunError
from hsv.graph.exclusive import claim_node, claim_topic


class ProcessNode(Node):
    """A node with an exit code, and with something to do between messages."""

    of_others: ClassVar[frozenset[str]] = frozenset()
    """Names of the parameters that this process was given for several nodes; set before any is made."""

    def __init__(self, name: str, namespace: str | None = None, **options: Any) -> None:
        """Make the node, with further ``options`` of rclpy's own."""
        super().__init__(name, namespace=namespace, **options)
        self.exit_code: int | None = None
        """Set when the node wants to end, to the exit code of the process."""
        self.beside: list[ProcessNode] = [self]
        """The nodes of this process."""
        self._claims: list[socket.socket] = []

    def claim_name(self, expected: str) -> None:
        """Keep the node's full name to it: others could not tell two of one name apart.

        Raises:
            RunError: Another node of this machine has it; ``expected`` says what is due.
        """
        name = self.get_fully_qualified_name()
        self._keep(claim_node(self.context.get_domain_id(), name), f"another node is called {name}", expected)

    def claim(self, topic: str, expected: str) -> None:
        """Reserve a topic for this node, before anything is published on it that could disturb another.

        Raises:
            RunError: Another node of this machine has it; ``expected`` says what is due.
        """
        name = self.resolve_topic_name(topic)
        self._keep(claim_topic(self.context.get_domain_id(), name), f"another node publishes {name}", expected)

    def _keep(self, held: socket.socket | None, taken: str, expected: str) -> None:
        if held is None:
            domain = self.context.get_domain_id()
            self.destroy_node()
            raise RunError(f"{taken} in ROS domain {domain}: expected {expected}")
        self._claims.append(held)

    def destroy_node(self) -> None:
        """Leave name and topics to others."""
        super().destroy_node()
        for held in self._claims:
            held.close()

    def finish(self, code: int) -> None:
        """End the process with ``code`` once the current callback has returned."""
        self.exit_code = code

    def poll(self) -> None:
        """Called between messages, at least four times a second until it ends; overridden to watch something."""

    def stopped(self, signal_number: int) -> int:
        """Return the exit code after a signal; overridden by nodes whose end is that of the run, which it cut short."""
        return 0

    def close(self) -> None:
        """Called once before the process ends; overridden where something must be saved."""

    def wait_timeout(self) -> float:
        """Return how long (s) to wait for a message before :meth:`poll` is due."""
        return 0.25
