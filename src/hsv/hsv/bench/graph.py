"""The graph of nodes against bare processes with the same hops, message sizes and recorder."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from hsv.bags.parameter_sections import ParameterSections
from hsv.bench.figure import Figure
from hsv.bench.ring import ring_lap
from hsv.graph.launcher import Launcher, parameter_arguments
from hsv.graph.preparation import RunOptions, prepare

_PERIOD = 0.02


def graph_lap(duration: float, *, composed: bool = False) -> float:
    """Return the mean time (s) of a step of the first ``duration`` (s) of Case 1 over DDS, recorded.

    Raises:
        RunError: A process ended before its time, or the workspace is not built.
    """
    times: dict[int, float] = {}
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        prepared = prepare("case1", RunOptions(composed=composed), bag=Path(folder, "bag"))
        shortened = Path(folder, "duration.yaml")
        shortened.write_text(ParameterSections({"duration": float(duration)}).to_yaml(), encoding="utf-8")
        arguments = parameter_arguments([*prepared.parameter_files, shortened])

        def on_step(step: int) -> None:
            times[step] = time.perf_counter()

        with Launcher(prepared.nodes, arguments, on_step, lambda node, text: None) as launcher:
            launcher.wait()
    first, last = min(times), max(times)
    return (times[last] - times[first]) / (last - first)


def against_rings(repeats: int, duration: float = 60.0) -> list[Figure]:
    """Return laps of the graph, as separate processes and in one, against bare rings, all measured in turn."""
    laps = round(duration / _PERIOD)
    separate, events, wait_set, composed, ordered = [], [], [], [], []
    for _ in range(repeats):
        separate.append(graph_lap(duration))
        events.append(ring_lap(laps, "events"))
        wait_set.append(ring_lap(laps, "wait_set"))
        composed.append(graph_lap(duration, composed=True))
        ordered.append(ring_lap(laps, "ordered", composed=True))
    ours, together = tuple(separate), tuple(composed)
    what, one = "lap of the graph, separate processes, recorded", "lap of the graph, composed, recorded"
    return [
        Figure("graph", what, "bare ring, EventsExecutor, same recorder", "s", ours, tuple(events), "most", 1.0, 0.8),
        Figure("graph_wait_set", what, "bare ring, raw WaitSet, same recorder", "s", ours, tuple(wait_set)),
        Figure(
            "composed",
            one,
            "bare loop in one process, ordered take, same recorder",
            "s",
            together,
            tuple(ordered),
            "most",
            1.1,
        ),
        _pace("separate processes", ours, 6.0, 8.0),
        _pace("composed", together, 25.0, 40.0),
    ]


def _pace(name: str, laps: tuple[float, ...], limit: float, goal: float) -> Figure:
    what = f"Case 1 over DDS, {name}: simulated over wall time"
    factors = tuple(_PERIOD / lap for lap in laps)
    return Figure(f"pace_{name.replace(' ', '_')}", what, "", "x real time", factors, (), "least", limit, goal)
