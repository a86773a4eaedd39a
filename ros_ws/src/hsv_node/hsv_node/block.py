"""Base class of the nodes that step one block of the loop, such as the notch filter or a controller."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from hsv_msgs.msg import Run

from hsv.bags.description import TOPIC_OF, NodeDescription
from hsv.bags.messages import StepMessages
from hsv.base.errors import HsvError, RunError, SignalError
from hsv.flight.blocks import Signals
from hsv.flight.flight import step_statistics
from hsv_node.lockstep import PeerNode


class BlockNode(PeerNode):
    """A node that steps its block of the loop when all messages of a step have arrived, and publishes the results."""

    component: Any
    """The object that computes the steps of the block, such as a notch filter; set by the subclass."""

    def __init__(self, role: NodeDescription, task: str) -> None:
        super().__init__(role, task)
        self.hear_runs(self._on_run)
        assert role.block is not None
        self._step = role.block.step
        self.signals = Signals()
        self._received: dict[str, tuple[int, bytes]] = {}
        """Step and bytes of the latest message of each topic."""
        # In the order of the role: other nodes wait for the first message and process it while the rest is published.
        self._answers = [(StepMessages(topic).pack, self.create_step_publisher(topic)) for topic in role.publishes]
        self._step_times = array("d")
        """Wall time (s) of each step of the component in this run."""
        self.messages = {topic: StepMessages(topic) for topic in self.role.subscribes}
        self._delays = {topic: int(topic in self.role.delayed) for topic in self.messages}
        for topic in self.messages:
            self.create_step_subscription(topic, partial(self.on_message, topic))

    def start_run(self, run: Run) -> None:
        """Reset the node's :attr:`component` for a new run and discard the messages of the previous run."""
        self._received.clear()
        self._step_times = array("d")
        self.component.reset()

    def stepped(self, signals: Signals) -> None:
        """Publish the diagnostics after a step; overridden by nodes that report more."""
        self.diagnose(signals)

    def serve(self, kind: Any, name: str, change: Callable[[Any], tuple[int, str]]) -> None:
        """Offer the service ``name``, which changes the flight.

        Args:
            kind: Type of the service, whose responses have ``success``, ``message`` and ``step``.
            name: Name of the service.
            change: Function that executes a request and returns the first changed step and a message; if it raises an
                HsvError, the request is rejected.
        """

        def respond(request: Any, response: Any) -> Any:
            try:
                response.step, response.message = change(request)
                response.success = True
                self.get_logger().info(response.message)
            except HsvError as error:
                response.message = str(error)
            return response

        self.create_service(kind, name, respond)

    def holds(self, step: int) -> bool:
        """Return whether ``step`` must wait although its messages have arrived; overridden by the trajectory node."""
        return False

    def on_message(self, topic: str, message: bytes) -> None:
        """Store a message, and execute the step that needs it if no other message is missing."""
        step = self.messages[topic].step(message)
        self._received[topic] = step, message
        self.answer(step + self._delays[topic])

    def answer(self, step: int) -> None:
        """Execute ``step`` and publish its messages, if its inputs have arrived and :meth:`holds` returns False."""
        signals = self.signals
        due = self._due(step)
        if not due or self.holds(step):
            return
        try:
            for name in due:
                self.messages[name].unpack(self._received[name][1], signals)
            begun = time.perf_counter()
            self._step(self.component, signals)
            self._step_times.append(time.perf_counter() - begun)
        except SignalError as error:
            self.refuse_message(TOPIC_OF[error.signal], error)
            return
        except RunError as error:
            self.fail(str(error))
            return
        for pack, publish in self._answers:
            publish(pack(signals))
        self.stepped(signals)

    def measured(self) -> dict[str, str]:
        """Return statistics of the wall time (ms) that a step has taken to compute in this run, as texts by name."""
        return {f"step_time_{name}": f"{value:.3f}" for name, value in step_statistics(self._step_times).items()}

    def _due(self, step: int) -> Sequence[str]:
        """Return the topics whose messages ``step`` needs; empty while one of these messages is missing."""
        due = []
        for name, delay in self._delays.items():
            # A delayed topic has the message of the previous step, which step 0 lacks.
            if step > 0 or not delay:
                if name not in self._received or self._received[name][0] + delay != step:
                    return ()
                due.append(name)
        return due
