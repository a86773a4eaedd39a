"""A node that steps a block of the loop when all messages of a step have arrived, and publishes the result."""

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
    """Steps its block with the messages of each step, and publishes the results on the topics of its role."""

    component: Any
    """The component that is stepped; set by the node."""

    def __init__(self, role: NodeDescription, task: str) -> None:
        super().__init__(role, task)
        self.hear_runs(self._on_run)
        assert role.block is not None
        self._step = role.block.step
        self.signals = Signals()
        self._received: dict[str, tuple[int, bytes]] = {}
        """The latest message of each topic, with its step."""
        # In the order of the role: other nodes wait for the first and work on it while the rest is published.
        self._answers = [(StepMessages(topic).pack, self.create_step_publisher(topic)) for topic in role.publishes]
        self._step_times = array("d")
        """Wall time (s) of each step of the component in this run."""
        self.messages = {topic: StepMessages(topic) for topic in self.role.subscribes}
        self._delays = {topic: int(topic in self.role.delayed) for topic in self.messages}
        for topic in self.messages:
            self.create_step_subscription(topic, partial(self.on_message, topic))

    def start_run(self, run: Run) -> None:
        """Forget the previous run."""
        self._received.clear()
        self._step_times = array("d")
        self.component.reset()

    def stepped(self, signals: Signals) -> None:
        """Publish the diagnostics; overridden by nodes that report more."""
        self.diagnose(signals)

    def serve(self, kind: Any, name: str, change: Callable[[Any], tuple[int, str]]) -> None:
        """Offer the service ``name`` that changes the flight.

        Args:
            kind: Type of the service, whose responses have ``success``, ``message`` and ``step``.
            name: Name of the service.
            change: Executes a request and returns the first changed step and the message; an error rejects it.
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
        """Return whether ``step`` has to wait although its messages are there; overridden by a node that plans."""
        return False

    def on_message(self, topic: str, message: bytes) -> None:
        """Step as soon as all messages of a step have arrived."""
        step = self.messages[topic].step(message)
        self._received[topic] = step, message
        self.answer(step + self._delays[topic])

    def answer(self, step: int) -> None:
        """Take ``step`` and publish its messages, if all that it needs has arrived and nothing holds it."""
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
        """Return the wall times of the steps of the component so far, in ms."""
        return {f"step_time_{name}": f"{value:.3f}" for name, value in step_statistics(self._step_times).items()}

    def _due(self, step: int) -> Sequence[str]:
        """Return the topics that ``step`` takes; none while one of their messages is missing."""
        due = []
        for name, delay in self._delays.items():
            # The first step has no previous one.
            if step > 0 or not delay:
                if name not in self._received or self._received[name][0] + delay != step:
                    return ()
                due.append(name)
        return due
