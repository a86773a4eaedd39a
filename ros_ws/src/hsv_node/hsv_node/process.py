"""A node that is a process of its own: what :func:`hsv_node.main.run_node` runs."""

from __future__ import annotations

from typing import ClassVar

from rclpy.node import Node


class ProcessNode(Node):
    """A node with an exit code, and with something to do between messages."""

    of_others: ClassVar[frozenset[str]] = frozenset()
    """Names of the parameters that this process was given for several nodes; set before any is made."""

    def __init__(self, name: str, namespace: str | None = None) -> None:
        super().__init__(name, namespace=namespace)
        self.exit_code: int | None = None
        """Set when the node wants to end, to the exit code of the process."""

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
