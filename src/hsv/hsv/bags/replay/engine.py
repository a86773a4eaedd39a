"""Feeding processes with messages in lockstep and comparing what they make of them with what was recorded."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from hsv.bags.compare import Comparison, compare
from hsv.bags.description import CLOCK, COMMAND, PLANT, STATE, TOPICS, WIRE_ALIGNMENT, step_topics
from hsv.bags.fields import blank, nanoseconds
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import broken_off, complete_steps, estimated
from hsv.bags.replay.processes import Process, processes_of
from hsv.bags.track import Track, expecting_fields
from hsv.base.errors import RecordingError
from hsv.base.processes import Progress

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


class _Outputs:
    """Output messages of a process, refilled at every step and stored as bytes."""

    def __init__(self, types: Typestore, topics: Mapping[str, str], source: str) -> None:
        self._source = source
        self._types = types
        self._kinds = topics
        self.messages = {topic: blank(types, kind) for topic, kind in topics.items()}
        self._fields = {topic: set(vars(message)) for topic, message in self.messages.items()}
        self.tracks = {topic: Track(topic, kind, types, [], [], "replay") for topic, kind in topics.items()}

    def keep(self) -> None:
        """Serialize the current messages."""
        for topic, message in self.messages.items():
            if vars(message).keys() != self._fields[topic]:
                new = ", ".join(sorted(vars(message).keys() - self._fields[topic]))
                raise RecordingError(
                    f"{self._source}: topic {topic}: recorded with another definition, expected a field {new}"
                )
            try:
                data = bytes(self._types.serialize_cdr(message, self._kinds[topic]))
            except (struct.error, TypeError, ValueError, SerdeError) as error:
                raise RecordingError(
                    f"{self._source}: topic {topic}: recorded with another definition, {error}"
                ) from None
            track = self.tracks[topic]
            track.data.append(data + bytes(-len(data) % WIRE_ALIGNMENT))
            track.times.append(nanoseconds(message.clock if topic == CLOCK else message.header.stamp))


def replay(bag: Bag, process: Process, values: ParameterSections, progress: Progress) -> ProcessComparison:
    """Feed ``process`` with its recorded inputs and compare its outputs.

    Args:
        bag: The recorded run.
        process: The process under test.
        values: Parameters of the nodes; the component under test takes those of its own.
        progress: Told how far it is.

    Raises:
        RecordingError: A topic is missing or recorded with another definition.
        ParameterError, DesignError: The component refuses its parameters.
    """
    require(bag, process.outputs)
    component = process.block.build(values.of(process.node.name))
    outputs = _Outputs(bag.types, {topic: TOPICS[topic] for topic in process.outputs}, str(bag.path))
    recorded = [bag.track(topic) for topic in process.inputs]
    steps = complete_steps(bag) if broken_off(bag) else complete_steps(bag, process.inputs)

    def step(inputs: tuple[Any, ...]) -> None:
        process.step(component, inputs, outputs.messages)
        outputs.keep()

    if process.restarts:
        step(())
        steps -= 1
    delayed = [topic in process.delayed for topic in process.inputs]
    columns = (
        chain([(0, None)] * late, t.cut(steps - late).decode()) for t, late in zip(recorded, delayed, strict=True)
    )
    messages = zip(*columns, strict=True)
    with expecting_fields(bag.path):
        for number, inputs in enumerate(messages):
            if number % PROGRESS_INTERVAL == 0:
                progress(process.node.name, number, steps)
            step(tuple(message for _, message in inputs))
    progress(process.node.name, steps, steps)
    return compare_process(bag, process, outputs.tracks)


def rerun(bag: Bag, controller: str, values: ParameterSections, progress: Progress) -> list[ProcessComparison]:
    """Repeat the whole loop in this process and compare every step topic.

    Args:
        bag: The recorded run.
        controller: Name of the controller that closes the loop.
        values: Parameters of the nodes.
        progress: Told how far it is.

    Raises:
        As :func:`replay`.
    """
    require(bag, step_topics(controller))
    with expecting_fields(bag.path):
        commands = None if COMMAND in _published(controller) else bag.decode(COMMAND)
        tracks = fly(bag.types, controller, values, progress, str(bag.path), commands)
    return [compare_process(bag, process, tracks) for process in processes_of(controller, estimated(values)).values()]


def fly(
    types: Typestore,
    controller: str,
    values: ParameterSections,
    progress: Progress,
    source: str = "types",
    commands: Iterator[tuple[int, Any]] | None = None,
) -> dict[str, Track]:
    """Fly the loop in this process, message by message as the graph does, and return every step topic.

    Args:
        types: Definitions of the messages.
        controller: Name of the controller that closes the loop.
        values: Parameters of the nodes.
        progress: Told how far it is.
        source: Source of ``types``, for error messages.
        commands: Recorded ones, with their times, of a controller that is a node of its own and not here.

    Raises:
        RecordingError: ``types`` lack a field, or commands are missing.
    """
    flown = processes_of(controller, estimated(values))
    components = {name: process.block.build(values.of(name)) for name, process in flown.items()}
    made = {
        name: _Outputs(types, {topic: TOPICS[topic] for topic in process.outputs}, source)
        for name, process in flown.items()
    }
    latest: dict[str, Any] = {}
    for outputs in made.values():
        latest |= outputs.messages
    last = components[PLANT.name].steps
    first = True
    while first or latest[STATE].status == 0:
        for name, process in flown.items():
            delayed = process.delayed
            if commands is not None and COMMAND in process.inputs and COMMAND not in delayed:
                latest[COMMAND] = _next(commands, source)
            given = () if process.restarts and first else process.inputs
            inputs = tuple(None if first and topic in delayed else latest[topic] for topic in given)
            outputs = made[name]
            process.step(components[name], inputs, outputs.messages)
            outputs.keep()
        first = False
        if latest[STATE].step % PROGRESS_INTERVAL == 0:
            progress("rerun", latest[STATE].step, last)
    progress("rerun", last, last)
    return {topic: track for outputs in made.values() for topic, track in outputs.tracks.items()}


def _published(controller: str) -> set[str]:
    return {topic for process in processes_of(controller).values() for topic in process.outputs}


def _next(commands: Iterator[tuple[int, Any]], source: str) -> Any:
    for _, message in commands:
        return message
    raise RecordingError(f"{source}: fewer commands than the flight has steps, and their controller is not here")


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
