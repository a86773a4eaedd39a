"""Replay with the real node processes: one by one against an emulator of all others, or the whole graph."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from hsv.bags.description import PEER_EMULATOR, PLANT, RUN, STATE, NodeDescription, graph, step_topics
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import estimated
from hsv.bags.replay.engine import ProcessComparison, compare_process, processes_of, require
from hsv.base.errors import RecordingError
from hsv.base.processes import Progress
from hsv.graph.launcher import Launcher, parameter_arguments


def replay_all(
    bag: Bag, names: Sequence[str], controller: str, values: ParameterSections, progress: Progress
) -> Iterator[ProcessComparison]:
    """Run each of the nodes ``names`` alone, fed from ``bag`` by a peer emulator; yield a comparison of its outputs.

    Raises:
        RecordingError: A topic that is needed is missing; no process has been started.
        RunError: A process failed; its last error line is in the message.
    """
    under_test = [processes_of(controller, estimated(values))[name] for name in names]
    for process in under_test:
        require(bag, (*process.inputs, *process.node.publishes))
    if not bag.messages(RUN):
        raise RecordingError(f"{bag.path}: topic {bag.name_of(RUN)}: no message, expected the announcement of the run")
    for process in under_test:
        name = process.node.name
        with tempfile.TemporaryDirectory(prefix="hsv_replay_") as folder:
            answers = Path(folder, "answers")
            emulator = {
                "peer_emulator.bag": str(bag.path.absolute()),
                "peer_emulator.node": name,
                "peer_emulator.directory": str(answers),
            }
            run = values.overlaid(ParameterSections({"recorder": False}, {PEER_EMULATOR.name: emulator}))
            steps = len(bag.messages(STATE))
            _run((process.node, PEER_EMULATOR), run, Path(folder), name, steps, progress)
            made = Bag(answers)
            yield compare_process(bag, process, {topic: made.track(topic) for topic in process.node.publishes})


def rerun(bag: Bag, controller: str, values: ParameterSections, progress: Progress) -> Iterator[ProcessComparison]:
    """Run the whole graph again; yield a comparison with ``bag`` for each node of the loop, except an external one."""
    require(bag, step_topics(controller))
    with tempfile.TemporaryDirectory(prefix="hsv_replay_") as folder:
        repeated = Path(folder, "rerun")
        steps = len(bag.messages(STATE))
        run = {"recorder": True, "bag.directory": str(repeated)}
        _run(graph(controller, estimated(values)), values.updated(run), Path(folder), PLANT.name, steps, progress)
        made = Bag(repeated)
        for process in processes_of(controller, estimated(values)).values():
            yield compare_process(bag, process, {topic: made.track(topic) for topic in process.node.publishes})


def _run(
    nodes: Sequence[NodeDescription],
    values: ParameterSections,
    folder: Path,
    title: str,
    steps: int,
    progress: Progress,
) -> None:
    """Run ``nodes`` until the last of them has ended: the peer emulator or, without one, the plant."""
    file = folder / "parameters.yaml"
    file.write_text(values.to_yaml(), encoding="utf-8")

    def line(_: str, text: str) -> None:
        if text.startswith("step "):
            progress(title, int(text.split()[1]), steps)

    arguments = parameter_arguments([file])
    with Launcher(nodes, arguments, lambda step: progress(title, step, steps), line) as launcher:
        launcher.wait()
