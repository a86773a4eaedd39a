"""An executor for a whole graph in one process, which knows that its messages flow around a loop."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy

SWEEPS = 128
"""Sweeps over all subscriptions between two looks at everything else (services, timers, a wish to stop)."""

BATCH = 0.005
"""Seconds in which the messages of a batch come: some steps at full speed, a quarter of one in real time."""

LOOKS = 8
"""Batches between two looks at everything else, and without a message after which the next one is waited for."""

_Subscription = tuple[Callable[..., Any], Any, bool, Callable[[Any], Any]]
"""What takes a message, with which arguments, and what is called with it."""


class FlowExecutor(SingleThreadedExecutor):
    """Takes messages subscription by subscription, node by node in the order they were added; waits if none came.

    Announcements that a node hears once a run are left to the wait set.

    With the nodes in the order of the data flow, one sweep is a step of the loop, and nothing is ever waited for: a
    message published in the same process is there when its reader's turn comes. Where it is not (another middleware),
    the wait set of the base class wakes on it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._subscriptions: list[_Subscription] = []
        self._flowing: list[_Subscription] = []
        """Those that are swept."""

    def add_node(self, node: Node) -> bool:
        """Add a node with the subscriptions that it has now; later ones are left to the base class."""
        for subscription in node.subscriptions:
            taken = (subscription.handle.take_message, subscription.msg_type, subscription.raw, subscription.callback)
            self._subscriptions.append(taken)
            # What a node is told once a run is not looked for in every step; what is recorded is, for its time is then.
            if subscription.raw or subscription.qos_profile.durability is not DurabilityPolicy.TRANSIENT_LOCAL:
                self._flowing.append(taken)
        return bool(super().add_node(node))

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Sweep while messages come, at most ``SWEEPS`` times; then run one other callback, waiting if none came."""
        sweeps = 0
        while sweeps < SWEEPS and self._sweep():
            sweeps += 1
        super().spin_once(timeout_sec=0.0 if sweeps else timeout_sec)

    def drain(self) -> bool:
        """Take all messages that have arrived, subscription by subscription, up to ``SWEEPS`` of each.

        Returns:
            Whether there were any.
        """
        came = False
        for take, kind, raw, callback in self._subscriptions:
            for _ in range(SWEEPS):
                taken = take(kind, raw)
                if taken is None:
                    break
                came = True
                callback(taken[0])
        return came

    def _sweep(self) -> bool:
        came = False
        for take, kind, raw, callback in self._flowing:
            taken = take(kind, raw)
            if taken is not None:
                came = True
                callback(taken[0])
        return came


class BatchExecutor(FlowExecutor):
    """Takes what has come in a while at once, for a node that nobody waits for.

    To be woken for every message takes longer than to take it, and the processor from those in the loop. Where nothing
    has come for ``LOOKS`` batches, the wait set of the base class wakes on the next message.
    """

    def __init__(self) -> None:
        super().__init__()
        self._batches = 0
        self._empty = LOOKS
        """Batches without a message; before the first message, all that there can be."""

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Take all that has come, and then let more come; now and then, and where nothing comes, all the rest."""
        self._empty = 0 if self.drain() else self._empty + 1
        if self._empty > LOOKS:
            SingleThreadedExecutor.spin_once(self, timeout_sec)
            return
        self._batches += 1
        if self._batches % LOOKS == 0:
            SingleThreadedExecutor.spin_once(self, 0.0)
        time.sleep(BATCH if timeout_sec is None else min(BATCH, timeout_sec))
