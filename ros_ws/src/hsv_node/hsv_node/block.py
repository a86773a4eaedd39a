"""A node that steps a block of the loop: joins the messages of a step, steps the component, publishes what it gives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from hsv_msgs.msg import Run

from hsv.bags.description import NodeDescription
from hsv.base.errors import RunError, SignalError
from hsv.flight.blocks import Signals
from hsv_node.lockstep import PeerNode
from hsv_node.wire import STEP_PLACE, Values, giver, taker


class BlockNode(PeerNode):
    """Answers the messages of each step with those of its block, on the topics of its role."""

    component: Any
    """The block that is stepped; set by the node."""

    def __init__(self, role: NodeDescription, task: str) -> None:
        super().__init__(role, task)
        assert role.block is not None
        self._step = role.block.step
        self.signals = Signals()
        self._given: dict[str, Values] = {}
        # In the order of the role: others wait for the first, and work on it while the rest is published.
        self._answers = [(giver(topic), self.create_step_publisher(topic)) for topic in role.publishes]
        self._take = {topic: taker(topic) for topic in self.role.subscribes}
        delayed = self.role.delayed
        self._delays = {topic: int(topic in delayed) for topic in self.role.subscribes}
        for topic in self.role.subscribes:
            self.create_step_subscription(topic, partial(self.on_message, topic))

    def start_run(self, run: Run) -> None:
        """Forget the run before."""
        self._given.clear()
        self.component.reset()

    def stepped(self, signals: Signals) -> None:
        """Called after each step; overridden to tell of it."""

    def on_message(self, topic: str, values: Values) -> None:
        """Step as soon as all messages of a step have arrived."""
        signals, given = self.signals, self._given
        given[topic] = values
        due = (topic,) if len(self._delays) == 1 else self._topics_of(values[STEP_PLACE] + self._delays[topic])
        if not due:
            return
        try:
            for name in due:
                self._take[name](given[name], signals)
            self.advance(signals)
        except SignalError as error:
            self.refuse_signal(error)
            return
        except RunError as error:
            # Not raised: the executor would print a traceback.
            self.get_logger().fatal(str(error))
            self.finish(1)
            return
        for give, publish in self._answers:
            publish(give(signals))
        self.stepped(signals)

    def _topics_of(self, step: int) -> Sequence[str]:
        """Return the topics that ``step`` takes, none as long as one of their messages is missing."""
        due = []
        for name, delay in self._delays.items():
            # Before the first step there is none.
            if step > 0 or not delay:
                if name not in self._given or self._given[name][STEP_PLACE] + delay != step:
                    return ()
                due.append(name)
        return due

    def advance(self, signals: Signals) -> None:
        """Step the component."""
        self._step(self.component, signals)
