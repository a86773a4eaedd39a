"""Replay in this process: step the components of nodes with recorded messages and compare their outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from rosbags.typesys.store import Typestore

from hsv.bags.columns import Track, expecting_fields
from hsv.bags.description import COMMAND, STATE, TOPICS, NodeDescription, graph, step_topics
from hsv.bags.diff import Comparison, compare
from hsv.bags.messages import StepMessages, stamp_in, stamp_of
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import broken_off, complete_steps, estimated
from hsv.base.errors import RecordingError
from hsv.base.processes import Progress
from hsv.control.design import design_of
from hsv.flight.blocks import LOOP, VEHICLE, Signals

PROGRESS_INTERVAL = 200

NOTHING: Mapping[str, Track] = {}

_TOLERANCES = {
    "plant": (
        1e-10,
        "one period from the recorded state: the vehicle alone is unstable, and a longer flight without its controller "
        "would magnify a difference in the last bit",
    ),
    "notch_filter": (1e-12, "a stable filter, in which rounding errors decay"),
    "nominal_trajectory": (
        1e-10,
        "a contracting system that runs on its own for the whole flight; laws solved in flight stop at a tolerance",
    ),
    "tube_mpc": (1e-10, "the level in the set is a quadratic form whose terms of both signs nearly cancel"),
    "robust_mpc": (1e-12, "one matrix product without memory"),
    "controller": (1e-10, "a custom controller may call libraries that round as their processor does"),
    "fault_injector": (0.0, "one multiplication, the same on every processor"),
}
"""Absolute and relative tolerance of each node, and the reason for it."""


@dataclass(frozen=True)
class Process:
    """A process under test: its node, and the tolerance (absolute and relative) of its outputs, with the reason."""

    node: NodeDescription
    tolerance: float
    reason: str

    @property
    def restarts(self) -> bool:
        """Whether every step starts from the previous step's state and actuator messages; only the plant's does."""
        return self.node.block is VEHICLE

    @property
    def inputs(self) -> tuple[str, ...]:
        """Topics whose messages a step uses."""
        return (*self.node.subscribes, STATE) if self.restarts else self.node.subscribes

    @property
    def delayed(self) -> tuple[str, ...]:
        """Topics of which a step uses the message of the previous step; the first step has none."""
        return self.inputs if self.restarts else self.node.delayed


def processes_of(controller: str, estimator: bool = False) -> dict[str, Process]:
    """Return the processes of a graph with ``controller``, by node, in the order in which a step passes through them.

    A controller that is an external node is not among them, because it cannot be repeated here.
    """
    nodes = {node.block: node for node in graph(controller, estimator) if not node.foreign}
    return {
        nodes[block].name: Process(nodes[block], *_TOLERANCES[nodes[block].name]) for block in LOOP if block in nodes
    }


@dataclass(frozen=True)
class ProcessComparison:
    """The outputs of one process compared with the recorded ones."""

    process: Process
    topics: tuple[Comparison, ...]

    @property
    def passed(self) -> bool:
        """Whether every output is equal within the tolerance."""
        return all(topic.first is None for topic in self.topics)

    @property
    def identical(self) -> bool:
        """Whether every output is equal in every byte except padding."""
        return all(topic.identical for topic in self.topics)


class _Replica:
    """The component of a process under test, stepped in this program, with its inputs and outputs as bytes."""

    def __init__(self, process: Process, values: ParameterSections, types: Typestore) -> None:
        assert process.node.block is not None
        self.process, block = process, process.node.block
        own = values.of(process.node.name)
        self.component = block.build(own, design_of(own) if block.designed else None)
        self._step = block.step
        self._inputs = {topic: StepMessages(topic, types) for topic in process.inputs}
        self._outputs = {topic: StepMessages(topic, types) for topic in process.node.publishes}
        self.tracks = {topic: Track(topic, TOPICS[topic], types, [], [], "replay") for topic in process.node.publishes}
        self.ended = False
        """Whether the plant has reported the end of the flight."""

    def step(self, inputs: Mapping[str, bytes]) -> dict[str, bytes]:
        """Step the component with ``inputs`` by topic (no delayed ones at step 0); return and keep its outputs."""
        signals = Signals()
        for topic, message in inputs.items():
            self._inputs[topic].unpack(message, signals)
        self._step(self.component, signals)
        if self.process.restarts:
            signals.stamp = stamp_of(signals.step, signals.period)
            self.ended = bool(signals.status)
        made = {topic: messages.pack(signals) for topic, messages in self._outputs.items()}
        for topic, message in made.items():
            self.tracks[topic].data.append(message)
            self.tracks[topic].times.append(stamp_in(message))
        return made


def replay(bag: Bag, process: Process, values: ParameterSections, progress: Progress) -> ProcessComparison:
    """Feed ``process`` with its recorded inputs, step it with its parameters in ``values``, and compare its outputs.

    Raises:
        RecordingError: A topic is missing or recorded with another definition.
        ParameterError, DesignError: The component refuses its parameters.
    """
    require(bag, process.node.publishes)
    recorded = {topic: bag.track(topic) for topic in process.inputs}
    steps = complete_steps(bag) if broken_off(bag) else complete_steps(bag, process.inputs)
    with expecting_fields(bag.path):
        tracks = _step([_Replica(process, values, bag.types)], recorded, steps, partial(progress, process.node.name))
    return compare_process(bag, process, tracks)


def rerun(bag: Bag, controller: str, values: ParameterSections, progress: Progress) -> list[ProcessComparison]:
    """Repeat the loop and compare the outputs of all nodes but an external ``controller``; raise as :func:`replay`."""
    require(bag, step_topics(controller))
    processes = processes_of(controller, estimated(values))
    known = any(COMMAND in process.node.publishes for process in processes.values())
    commands = {} if known else {COMMAND: bag.track(COMMAND)}
    limit = complete_steps(bag) if broken_off(bag) else None
    with expecting_fields(bag.path):
        tracks = fly(bag.types, controller, values, progress, commands, limit)
    return [compare_process(bag, process, tracks) for process in processes.values()]


def fly(
    types: Typestore,
    controller: str,
    values: ParameterSections,
    progress: Progress,
    recorded: Mapping[str, Track] = NOTHING,
    limit: int | None = None,
) -> dict[str, Track]:
    """Fly the loop in this process; return the messages of the stepped nodes, by topic, without those ``recorded``.

    Args:
        types: Definitions of the messages.
        controller: Name of the controller that closes the loop.
        values: Parameters of the nodes.
        progress: Called with a title, the number of steps flown, and the number of all.
        recorded: Recorded commands of a controller that is an external node, by topic.
        limit: Maximum number of steps, for a run that was broken off; None: as many as the plant's parameters give.
    """
    replicas = [_Replica(process, values, types) for process in processes_of(controller, estimated(values)).values()]
    plant = next(replica for replica in replicas if replica.process.restarts)
    steps = plant.component.steps + 1 if limit is None else limit
    return _step(replicas, recorded, steps, partial(progress, "rerun"))


def _step(
    replicas: Sequence[_Replica], recorded: Mapping[str, Track], steps: int, progress: Callable[[int, int], None]
) -> dict[str, Track]:
    """Step ``replicas`` message by message as the graph does, at most ``steps`` times; return their outputs by topic.

    Topics in ``recorded`` are taken from there, also if a replica publishes them.
    """
    latest: dict[str, bytes] = {}
    for step in range(steps):
        if step % PROGRESS_INTERVAL == 0:
            progress(step, steps)
        if short := next((track for track in recorded.values() if step >= len(track.data)), None):
            raise RecordingError(
                f"{short.source}: topic {short.topic}: {step} messages, expected one for every step of the flight"
            )
        for replica in replicas:
            process = replica.process
            prompt = recorded.keys() & {*process.inputs} - {*process.delayed}
            latest |= {topic: recorded[topic].data[step] for topic in prompt}
            latest |= replica.step({topic: latest[topic] for topic in process.inputs if topic in latest})
        latest |= {topic: track.data[step] for topic, track in recorded.items()}
        if any(replica.ended for replica in replicas):
            break
    progress(steps, steps)
    return {topic: track for replica in replicas for topic, track in replica.tracks.items()}


def require(bag: Bag, topics: Iterable[str]) -> None:
    """Raise a RecordingError unless all ``topics`` are in ``bag``."""
    for topic in topics:
        bag.track(topic)


def compare_process(bag: Bag, process: Process, tracks: Mapping[str, Track]) -> ProcessComparison:
    """Compare the ``tracks`` of ``process`` with those in ``bag``; only complete steps if the run was broken off."""
    limit = complete_steps(bag) if broken_off(bag) else None
    compared = []
    for topic in process.node.publishes:
        expected, actual = bag.track(topic), tracks[topic]
        if limit is not None:
            expected, actual = expected.cut(limit), actual.cut(limit)
        compared.append(compare(expected, actual, tolerance=process.tolerance))
    return ProcessComparison(process, tuple(compared))
