"""Emulator of all peers of one node under test: feeds it from a bag, step by step, and records its outputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hsv_msgs.msg import Ready, Run

from hsv.bags import description
from hsv.bags.definitions import definition, type_hash
from hsv.bags.infrastructure_parameters import PEER_EMULATOR_PARAMETERS
from hsv.bags.messages import stamp_in
from hsv.bags.metadata import Topic, usual_qos
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import broken_off, complete_steps
from hsv.bags.writer import BagWriter
from hsv.graph.standstill import Standstill
from hsv_node.lockstep import LockstepNode
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, STEP, message_class
from hsv_node.parameters import declare


class PeerEmulatorNode(LockstepNode):
    """A node that replaces all peers of the node under test and publishes their messages from a bag.

    The parameter ``peer_emulator.node`` names the node under test, which is linked to the emulator only.
    """

    def __init__(self) -> None:
        super().__init__(description.PEER_EMULATOR, "replay")
        values = declare(self, PEER_EMULATOR_PARAMETERS)
        self._bag = bag = Bag(values["peer_emulator.bag"])
        self._under_test = values["peer_emulator.node"]
        self._limit = values["peer_emulator.timeout"]
        me = next(n for n in description.graph(self.controller, self.estimator) if n.name == self._under_test)
        self._is_plant = me is description.PLANT
        self._steps = complete_steps(bag) if broken_off(bag) else complete_steps(bag, me.subscribes)
        self._recorded = {topic: [data for _, data in bag.messages(topic)] for topic in me.subscribes}
        self._delayed = () if self._is_plant else me.delayed
        self._answered = dict.fromkeys(me.publishes, 0)
        self._fed = 0
        self._output = BagWriter(Path(values["peer_emulator.directory"]))
        self._emulated = description.peers(me, self.controller, recorded=False, estimator=self.estimator)
        self._feeds: dict[str, Callable[[bytes], None]] = {}
        for peer in self._emulated:
            for topic in peer.publishes:
                self.claim(topic, f"no {peer.name} while its emulator runs")
                publish = self.create_step_publisher(topic)
                if topic in me.subscribes:
                    self._feeds[topic] = publish
            for topic in set(me.publishes) & set(peer.subscribes):
                # The node under test counts an endpoint per peer. Its outputs are read by the subscriptions below.
                kind = message_class(description.TOPICS[topic])
                self.create_subscription(kind, topic, lambda message: None, STEP, raw=True)
        for topic in me.publishes:
            kind = description.TOPICS[topic]
            name = self.resolve_topic_name(topic)
            self._output.add_topic(Topic(name, kind, definition(kind), type_hash(kind), usual_qos(STEP.depth)))
            self.create_subscription(message_class(kind), topic, partial(self._on_answer, topic), STEP, raw=True)
        self._ready = self._join()
        self._standstill = Standstill()

    def _join(self) -> bool:
        """Announce a run and return False; for a plant under test, prepare to announce its peers and return True."""
        if self._is_plant:
            self._announcer = self.create_publisher(Ready, description.READY, LATCHED)
            self.create_subscription(Run, description.RUN, self._on_run, LATCHED)
            return True
        recorded = next((message for _, message in self._bag.decode(description.RUN)), None)
        assert recorded is not None, "hsv replay takes no bag without the announcement of its run"
        run = Run(run_id="replay", interface_version=Run.INTERFACE_VERSION)
        run.period, run.last_step, run.seed = recorded.period, recorded.last_step, recorded.seed
        self._announcer = self.create_publisher(Run, description.RUN, LATCHED)
        self._announcer.publish(run)
        self.create_subscription(Ready, description.READY, self._on_ready, LATCHED)
        return False

    def _on_run(self, run: Run) -> None:
        for peer in self._emulated:
            self._announcer.publish(Ready(node=peer.name, run_id=run.run_id))

    def _on_ready(self, ready: Ready) -> None:
        if ready.node == self._under_test:
            self._ready = True

    def _on_answer(self, topic: str, data: bytes) -> None:
        self._output.write(self.resolve_topic_name(topic), stamp_in(data), data)
        self._answered[topic] += 1
        self._feed()

    def _feed(self) -> None:
        """Send the next step to the node under test if it has answered the previous one; finish after the last."""
        done = min(self._answered.values())
        # The plant publishes the first state without an input.
        if done >= self._steps and (not self._is_plant or self._fed >= self._steps):
            self.finish(0)
        elif self._fed < self._steps and done >= self._fed + self._is_plant:
            for topic, publish in self._feeds.items():
                step = self._fed - (topic in self._delayed)
                if step >= 0:
                    publish(self._recorded[topic][step])
            self._fed += 1
            if self._fed % 200 == 0:
                print(f"step {self._fed}", flush=True)
            if self._is_plant and self._fed == self._steps:
                self.finish(0)

    def poll(self) -> None:
        """Start when the links are matched; end the process if the node under test does not answer in time."""
        if not self._is_plant and self._ready and self._fed == 0 and self._connected():
            self._feed()
        answers = sum(self._answered.values())
        if not answers and not self._fed:
            # There is no limit for the start of the node: its launcher sees whether it ends or hangs.
            self.log_waiting([self._under_test], decides=True)
        elif self._standstill.look((self._fed, answers)) > self._limit:
            silent = [topic for topic, count in self._answered.items() if count <= min(self._answered.values())]
            step, topics = min(self._answered.values()), ", ".join(silent)
            self.fail(f"step {step}: no {topics} from {self._under_test} for {self._limit:g} s")

    def _connected(self) -> bool:
        fed = all(self._matched(topic) for topic in self._feeds)
        return fed and all(self.count_publishers(topic) for topic in self._answered)

    def stopped(self, signal_number: int) -> int:
        """Return the exit code after a signal, 128 + ``signal_number``: the replay is incomplete."""
        return 128 + signal_number

    def close(self) -> None:
        """Finish the bag of recorded outputs."""
        self._output.close()


main = partial(run_node, PeerEmulatorNode, "peer_emulator")
