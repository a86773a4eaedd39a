"""Replay with the real node processes: the whole graph flies again."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from hsv.bags.description import STATE, graph, step_topics
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import estimated
from hsv.bags.replay.engine import ProcessComparison, compare_process, processes_of, require
from hsv.base.processes import Progress
from hsv.graph.launcher import Launcher, parameter_arguments


def replay(bag: Bag, controller: str, values: ParameterSections, progress: Progress) -> Iterator[ProcessComparison]:
    """Run the whole graph again; yield a comparison with ``bag`` for each node of the loop.

    Raises:
        RecordingError: A topic that is needed is missing; no process has been started.
        RunError: A process failed; its last error line is in the message.
    """
    require(bag, step_topics(controller))
    with tempfile.TemporaryDirectory(prefix="hsv_replay_") as folder:
        file, repeated = Path(folder, "parameters.yaml"), Path(folder, "rerun")
        run = values.updated({"recorder": True, "bag.directory": str(repeated)})
        file.write_text(run.to_yaml(), encoding="utf-8")
        nodes, steps = graph(controller, estimated(values)), len(bag.messages(STATE))

        def step(number: int) -> None:
            progress("over DDS", number, steps)

        with Launcher(nodes, parameter_arguments([file]), step, lambda *_: None) as launcher:
            launcher.wait()
        made = Bag(repeated)
        for process in processes_of(controller, estimated(values)).values():
            yield compare_process(bag, process, {topic: made.track(topic) for topic in process.node.publishes})
