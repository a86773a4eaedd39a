"""Emulator of all peers of one node: it feeds the node from a bag, step by step, and records the outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from hsv_msgs.msg import Ready, Run
from rclpy.node import Node

from hsv.bags import description
from hsv.bags.definitions import definition, type_hash
from hsv.bags.description import NodeDescription
from hsv.bags.infrastructure_parameters import PEER_EMULATOR_PARAMETERS
from hsv.bags.messages import stamp_in
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import broken_off, complete_steps
from hsv.bags.topic import Topic, usual_qos
from hsv.bags.writer import BagWriter
from hsv.graph.standstill import Standstill
from hsv_node.lockstep import LockstepNode
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, STEP, message_class
from hsv_node.parameters import declare


class PeerEmulatorNode(LockstepNode):
    """A node that emulates the peers of ``peer_emulator.node``, each under its name, with the messages in a bag."""

    def __init__(self) -> None:
        super().__init__(description.PEER_EMULATOR, "replay")
        values = declare(self, PEER_EMULATOR_PARAMETERS)
        bag = Bag(values["peer_emulator.bag"])
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
        self._peers: dict[str, Node] = {}
        published = {topic: publisher for peer in self._emulated for topic, publisher in self._emulate(peer, me)}
        self._feeds = {topic: published[topic] for topic in me.subscribes}
        for topic in me.publishes:
            kind = description.TOPICS[topic]
            name = self.resolve_topic_name(topic)
            self._output.add_topic(Topic(name, kind, definition(kind), type_hash(kind), usual_qos(STEP.depth)))
            answer: Callable[[bytes], None] = partial(self._on_answer, topic, name)
            self.create_subscription(message_class(kind), topic, answer, STEP, raw=True)
        self._run = next((message for _, message in bag.decode(description.RUN)), None)
        self._ready = self._join()
        self._standstill = Standstill()

    def _emulate(self, peer: NodeDescription, me: NodeDescription) -> Iterator[tuple[str, Any]]:
        """Create a node with the topics of ``peer``, which identify it, and yield its publishers by topic."""
        node = rclpy.create_node(
            peer.name, namespace=self.get_namespace(), context=self.context, use_global_arguments=False
        )
        self._peers[peer.name] = node
        for topic in peer.publishes:
            self.claim(topic, f"no {peer.name} while its emulator runs")
            yield topic, node.create_publisher(message_class(description.TOPICS[topic]), topic, STEP)
        for topic in me.publishes:
            if topic in peer.subscribes:
                node.create_subscription(message_class(description.TOPICS[topic]), topic, _ignore, STEP, raw=True)

    def _join(self) -> bool:
        """Announce a run to the node under test, or all peers as ready to a plant; return whether to start at once."""
        if self._is_plant:
            self._announcer = self.create_publisher(Ready, description.READY, LATCHED)
            self.create_subscription(Run, description.RUN, self._on_run, LATCHED)
            return True
        assert self._run is not None, "hsv replay takes no bag without the announcement of its run"
        run = Run(
            run_id="replay",
            period=self._run.period,
            last_step=self._run.last_step,
            seed=self._run.seed,
            interface_version=Run.INTERFACE_VERSION,
        )
        self._announcer = self._peers[description.PLANT.name].create_publisher(Run, description.RUN, LATCHED)
        self._announcer.publish(run)
        self.create_subscription(Ready, description.READY, self._on_ready, LATCHED)
        return False

    def _on_run(self, run: Run) -> None:
        for peer in self._emulated:
            self._announcer.publish(Ready(node=peer.name, run_id=run.run_id))

    def _on_ready(self, ready: Ready) -> None:
        if ready.node == self._under_test:
            self._ready = True

    def _on_answer(self, topic: str, name: str, data: bytes) -> None:
        self._output.write(name, stamp_in(data), data)
        self._answered[topic] += 1
        self._feed()

    def _feed(self) -> None:
        """Send the next step to the node under test if it has answered the previous one."""
        done = min(self._answered.values())
        # The plant publishes the first state without an input.
        if done >= self._steps and (not self._is_plant or self._fed >= self._steps):
            self.finish(0)
        elif self._fed < self._steps and done >= self._fed + self._is_plant:
            for topic, publisher in self._feeds.items():
                step = self._fed - (topic in self._delayed)
                if step >= 0:
                    publisher.publish(self._recorded[topic][step])
            self._fed += 1
            if self._fed % 200 == 0:
                print(f"step {self._fed}", flush=True)
            if self._is_plant and self._fed == self._steps:
                self.finish(0)

    def poll(self) -> None:
        """Start when the links are connected; end if the node under test does not answer in time."""
        if not self._is_plant and self._ready and self._fed == 0 and self._connected():
            self._feed()
        answers = sum(self._answered.values())
        if not answers and not self._fed:
            # There is no limit for the start of the node: its launcher sees whether it ends or hangs.
            self.log_waiting(lambda: [self._under_test], decides=True)
        elif self._standstill.look((self._fed, answers)) > self._limit:
            silent = [topic for topic, count in self._answered.items() if count <= min(self._answered.values())]
            self.get_logger().fatal(
                f"step {min(self._answered.values())}: no {', '.join(silent)} from {self._under_test} "
                f"for {self._limit:g} s"
            )
            self.finish(1)

    def _connected(self) -> bool:
        return all(publisher.get_subscription_count() > 0 for publisher in self._feeds.values()) and all(
            self.count_publishers(topic) > 0 for topic in self._answered
        )

    def stopped(self, signal_number: int) -> int:
        """Return the exit code of an incomplete replay."""
        return 128 + signal_number

    def close(self) -> None:
        """Finish the bag with the outputs."""
        for peer in self._peers.values():
            peer.destroy_node()
        self._output.close()


def _ignore(_: bytes) -> None:
    """Ignore a message: the subscription only makes the peer visible, and the emulator itself reads the answers."""


main = partial(run_node, PeerEmulatorNode, "peer_emulator")
