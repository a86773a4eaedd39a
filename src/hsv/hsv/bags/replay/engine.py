"""Feed processes with recorded messages in lockstep and compare their answers with the recorded ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rosbags.typesys.store import Typestore

from hsv.bags.compare import Comparison, compare
from hsv.bags.description import COMMAND, FAULT_INJECTOR, STATE, TOPICS, step_topics
from hsv.bags.messages import StepMessages, stamp_in, stamp_of
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import broken_off, complete_steps, estimated
from hsv.bags.replay.processes import Process, processes_of
from hsv.bags.track import Track, expecting_fields
from hsv.base.errors import RecordingError
from hsv.base.processes import Progress
from hsv.flight.blocks import Signals

PROGRESS_INTERVAL = 200


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
        """Whether every output is equal in every byte."""
        return all(topic.identical for topic in self.topics)


class _Replica:
    """A process under test in this program: its component, and its messages as bytes."""

    def __init__(self, process: Process, values: ParameterSections, types: Typestore) -> None:
        self.process = process
        self.component = process.block.build(values.of(process.node.name))
        self._inputs = {topic: StepMessages(topic, types) for topic in process.inputs}
        self._outputs = {topic: StepMessages(topic, types) for topic in process.outputs}
        self.tracks = {topic: Track(topic, TOPICS[topic], types, [], [], "replay") for topic in process.outputs}

    def step(self, inputs: Mapping[str, bytes]) -> dict[str, bytes]:
        """Step the component, and return and keep its output messages by topic.

        Args:
            inputs: Input messages by topic, without those of a step before the first; none for the first state.

        Raises:
            RunError: A message cannot be used.
        """
        signals = Signals()
        for topic, message in inputs.items():
            self._inputs[topic].unpack(message, signals)
        self.process.block.step(self.component, signals)
        if self.process.restarts:
            signals.stamp = stamp_of(signals.step, signals.period)
        made = {topic: messages.pack(signals) for topic, messages in self._outputs.items()}
        for topic, message in made.items():
            self.tracks[topic].data.append(message)
            self.tracks[topic].times.append(stamp_in(message))
        return made


def replay(bag: Bag, process: Process, values: ParameterSections, progress: Progress) -> ProcessComparison:
    """Feed ``process`` with its recorded inputs and compare its outputs.

    Args:
        bag: The recorded run.
        process: The process under test.
        values: Parameters of the nodes; the component under test takes its own.
        progress: Called with the progress.

    Raises:
        RecordingError: A topic is missing or recorded with another definition.
        ParameterError, DesignError: The component refuses its parameters.
    """
    require(bag, process.outputs)
    replica = _Replica(process, values, bag.types)
    recorded = {topic: bag.track(topic).data for topic in process.inputs}
    steps = complete_steps(bag) if broken_off(bag) else complete_steps(bag, process.inputs)
    with expecting_fields(bag.path):
        if process.restarts:
            replica.step({})
            steps -= 1
        for number in range(steps):
            if number % PROGRESS_INTERVAL == 0:
                progress(process.node.name, number, steps)
            rows = {topic: number - (topic in process.delayed) for topic in process.inputs}
            replica.step({topic: recorded[topic][row] for topic, row in rows.items() if row >= 0})
    progress(process.node.name, steps, steps)
    return compare_process(bag, process, replica.tracks)


def rerun(bag: Bag, controller: str, values: ParameterSections, progress: Progress) -> list[ProcessComparison]:
    """Repeat the whole loop in this process and compare every step topic.

    Args:
        bag: The recorded run.
        controller: Name of the controller that closes the loop.
        values: Parameters of the nodes.
        progress: Called with the progress.

    Raises:
        As :func:`replay`.
    """
    require(bag, step_topics(controller))
    processes = processes_of(controller, estimated(values))
    known = any(COMMAND in process.outputs for process in processes.values())
    with expecting_fields(bag.path):
        tracks = fly(bag.types, controller, values, progress, None if known else bag.track(COMMAND))
    return [compare_process(bag, process, tracks) for process in processes.values()]


def fly(
    types: Typestore,
    controller: str,
    values: ParameterSections,
    progress: Progress,
    commands: Track | None = None,
) -> dict[str, Track]:
    """Fly the loop in this process, message by message as the graph does, and return every step topic.

    Args:
        types: Definitions of the messages.
        controller: Name of the controller that closes the loop.
        values: Parameters of the nodes.
        progress: Called with the progress.
        commands: Recorded commands of a controller that is an external node.

    Raises:
        RunError: ``types`` lack a field.
        RecordingError: There are fewer ``commands`` than steps.
    """
    replicas = [_Replica(process, values, types) for process in processes_of(controller, estimated(values)).values()]
    plant = next(replica for replica in replicas if replica.process.restarts)
    signals, state = Signals(), StepMessages(STATE, types)
    latest: dict[str, bytes] = {}
    for step in range(plant.component.steps + 1):
        for replica in replicas:
            if replica.process.node is FAULT_INJECTOR and commands is not None:
                if step >= len(commands.data):
                    raise RecordingError(
                        f"{commands.source}: fewer commands than the flight has steps, and their controller is not here"
                    )
                latest[COMMAND] = commands.data[step]
            inputs = () if step == 0 and replica is plant else replica.process.inputs
            latest |= replica.step({topic: latest[topic] for topic in inputs if topic in latest})
        state.unpack(latest[STATE], signals)
        if step % PROGRESS_INTERVAL == 0:
            progress("rerun", step, plant.component.steps)
        if signals.status:
            break
    progress("rerun", plant.component.steps, plant.component.steps)
    return {topic: track for replica in replicas for topic, track in replica.tracks.items()}


def require(bag: Bag, topics: Iterable[str]) -> None:
    """Raise a RecordingError unless all ``topics`` are in ``bag``."""
    for topic in topics:
        bag.track(topic)


def compare_process(bag: Bag, process: Process, tracks: Mapping[str, Track]) -> ProcessComparison:
    """Compare the outputs of ``process`` with those in ``bag``; of a run that was broken off, its complete steps."""
    limit = complete_steps(bag) if broken_off(bag) else None
    compared = []
    for topic in process.outputs:
        expected, actual = bag.track(topic), tracks[topic]
        if limit is not None:
            expected, actual = expected.cut(limit), actual.cut(limit)
        compared.append(compare(expected, actual, tolerance=process.tolerance))
    return ProcessComparison(process, tuple(compared))
