"""Executors that take messages directly from the subscriptions: for all nodes in one process, and for the recorder."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy

SWEEPS = 128
"""Maximum number of sweeps over all subscriptions between checks of services, timers and shutdown."""

BATCH = 0.005
"""Time (s) between batches of messages: several steps at full speed, a quarter of a step in real time."""

LOOKS = 8
"""Number of batches between checks of services and timers; after more empty batches than that the executor waits."""

_Subscription = tuple[Callable[..., Any], Any, bool, Callable[[Any], Any]]
"""Function that takes a message from a subscription, its two arguments (type, raw), and the callback."""


class FlowExecutor(SingleThreadedExecutor):
    """An executor that asks each subscription in turn for a message, node by node, and waits only if none has any.

    If the nodes are in the order of the data flow, one sweep over the subscriptions is one step of the loop: a message
    published in the same process has usually arrived when its subscription is asked. If it has not (with another
    middleware), the executor waits for it with the wait set of the base class.

    Messages on latched topics are rare: their subscriptions are left to the wait set. Raw ones among them, such as
    the recorder's, are swept nevertheless, so that a message is recorded as it arrives.
    """

    def __init__(self) -> None:
        super().__init__()
        self._subscriptions: list[_Subscription] = []
        self._flowing: list[_Subscription] = []
        """The subscriptions that :meth:`spin_once` sweeps."""

    def add_node(self, node: Node) -> bool:
        """Add a node with its present subscriptions; later ones are left to the base class."""
        if not super().add_node(node):
            return False  # rclpy sets node.executor while it adds a node, which calls this a second time
        for subscription in node.subscriptions:
            taken = (subscription.handle.take_message, subscription.msg_type, subscription.raw, subscription.callback)
            self._subscriptions.append(taken)
            # Announcements are left to the wait set. Recorded topics are swept: a message is recorded as it arrives.
            if subscription.raw or subscription.qos_profile.durability is not DurabilityPolicy.TRANSIENT_LOCAL:
                self._flowing.append(taken)
        return True

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Sweep while messages arrive, up to ``SWEEPS`` times; then let the base class run a callback, if any is due.

        It waits up to ``timeout_sec`` for a callback only if the first sweep found no message.
        """
        sweeps = 0
        while sweeps < SWEEPS and self._take(self._flowing, 1):
            sweeps += 1
        super().spin_once(timeout_sec=0.0 if sweeps else timeout_sec)

    def drain(self) -> bool:
        """Take the messages that have arrived, at most ``SWEEPS`` per subscription; return whether there were any."""
        return self._take(self._subscriptions, SWEEPS)

    def _take(self, subscriptions: list[_Subscription], limit: int) -> bool:
        came = False
        for take, kind, raw, callback in subscriptions:
            for _ in range(limit):
                taken = take(kind, raw)
                if taken is None:
                    break
                came = True
                callback(taken[0])
        return came


class BatchExecutor(FlowExecutor):
    """An executor that takes messages in batches, for a node outside the loop.

    Waking up for every message would take processor time from the nodes in the loop. After ``LOOKS`` empty batches, it
    waits for the next message with the wait set of the base class.
    """

    def __init__(self) -> None:
        super().__init__()
        self._batches = 0
        self._empty = LOOKS
        """Number of consecutive empty batches."""

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Take all messages that have arrived and sleep until the next batch; run other callbacks every few batches."""
        self._empty = 0 if self.drain() else self._empty + 1
        if self._empty > LOOKS:
            SingleThreadedExecutor.spin_once(self, timeout_sec)
            return
        self._batches += 1
        if self._batches % LOOKS == 0:
            SingleThreadedExecutor.spin_once(self, 0.0)
        time.sleep(BATCH if timeout_sec is None else min(BATCH, timeout_sec))
