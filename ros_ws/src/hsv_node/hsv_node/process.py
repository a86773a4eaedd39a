"""Base class of the nodes, which can end their process with an exit code; and a time limit for that end."""

from __future__ import annotations

import ctypes
import signal
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from rclpy.node import Node

from hsv.base.errors import RunError
from hsv.graph.exclusive import claim

_MONOTONIC = 1
_NEW_THREAD = 2
"""``CLOCK_MONOTONIC`` and ``SIGEV_THREAD`` of Linux."""


class ProcessNode(Node):
    """A node that can end its process with an exit code; :meth:`poll` is called between messages."""

    own_only: ClassVar[frozenset[str]] = frozenset()
    """Names of the parameters given with ``-p`` to a process of one node, which must be parameters of that node."""
    parameter_files: ClassVar[tuple[str, ...]] = ()
    """The parameter files given to the process."""

    def __init__(self, name: str, namespace: str | None = None, **options: Any) -> None:
        """Create the node with further ``options`` of rclpy."""
        super().__init__(name, namespace=namespace, **options)
        self.exit_code: int | None = None
        """Exit code with which the process is to end; None while the node runs."""
        self.process_nodes: list[ProcessNode] = [self]
        """The nodes of this process."""
        self._claims: list[socket.socket] = []

    def claim(self, topic: str | None, expected: str) -> None:
        """Reserve ``topic`` or, if it is None, the full name of this node; called before the node publishes.

        Raises:
            RunError: Another node of this machine has reserved the name; the message ends with ``expected``.
        """
        name = self.resolve_topic_name(topic) if topic else self.get_fully_qualified_name()
        domain = self.context.get_domain_id()
        held = claim("topic" if topic else "node", domain, name)
        if held is None:
            self.destroy_node()
            use = "publishes" if topic else "is called"
            raise RunError(f"another node {use} {name} in ROS domain {domain}: expected {expected}")
        self._claims.append(held)

    def destroy_node(self) -> None:
        """Destroy the node and release its reserved name and topics."""
        super().destroy_node()
        for held in self._claims:
            held.close()

    def finish(self, code: int) -> None:
        """End the process with ``code`` once the current callback has returned."""
        self.exit_code = code

    def poll(self) -> None:
        """Run a task between messages, at least four times per second; does nothing unless overridden."""

    def stopped(self, signal_number: int) -> int:
        """Return the exit code after a signal: 0 after Ctrl-C, otherwise 128 + ``signal_number``."""
        return 0 if signal_number == signal.SIGINT else 128 + signal_number

    def close(self) -> None:
        """Save data before the process ends; does nothing unless overridden."""

    def wait_timeout(self) -> float:
        """Return how long (s) to wait for a message before :meth:`poll` is due."""
        return 0.25


@contextmanager
def ends_with(code: int, within: float = 3.0) -> Iterator[None]:
    """End the process with exit code ``code`` if the body takes longer than ``within`` seconds.

    The body destroys the nodes, after all data has been written. Fast DDS 2.14 can deadlock there: the thread that has
    just discovered another participant and the thread that removes the listener wait for each other. They do so below
    rclpy, with Python's interpreter locked, so that only a timer of the operating system can end the process. If the
    system refuses the timer, the body runs without it.
    """
    library = ctypes.CDLL(None)
    exit_now = ctypes.cast(library._exit, ctypes.c_void_p).value
    # struct sigevent: value, signal, notification, function, attributes; struct itimerspec: no period, seconds and ns.
    event = struct.pack("liiPP32x", code, 0, _NEW_THREAD, exit_now, 0)
    times = struct.pack("llll", 0, 0, int(within), int(within % 1 * 1e9))
    timer = ctypes.c_void_p()
    if library.timer_create(_MONOTONIC, event, ctypes.byref(timer)):
        yield
        return
    library.timer_settime(timer, 0, times, None)
    try:
        yield
    finally:
        library.timer_delete(timer)
