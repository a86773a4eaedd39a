"""Bare processes that pass messages on as the graph does: started, timed, ended."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from hsv.bags.description import PLANT, NodeDescription, graph
from hsv.base.errors import RunError
from hsv.graph.launcher import executable

_RING = NodeDescription("ring", "hsv_bench", "ring", (), ())


def ring_lap(laps: int, loop: str, *, composed: bool = False) -> float:
    """Return the mean time (s) of a lap of the bare ring, its recorder running.

    Args:
        laps: Number of laps.
        loop: ``"events"`` (rclpy's EventsExecutor), ``"wait_set"`` (none) or ``"ordered"`` (none, one process).
        composed: All in one process.

    Raises:
        RunError: A process ended before its time, or the workspace is not built.
    """
    names = ["all"] if composed else [node.name for node in graph()]
    program = str(executable(_RING))
    processes: list[subprocess.Popen[str]] = []
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        try:
            for name in names:
                command = [program, name, str(laps), loop, str(Path(folder, "bag"))]
                pipe = subprocess.PIPE
                processes.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True))
            for process in processes:
                _line(process)
            # The plant's last: from then on the laps run.
            for process in processes:
                _say(process)
            seconds = {name: float(_line(process)) for name, process in zip(names, processes, strict=True)}
            for process in processes:
                _say(process)
                process.wait()
        finally:
            for process in processes:
                process.kill()
                process.communicate()
    return seconds["all" if composed else PLANT.name] / laps


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        words = process.stderr.read() if process.stderr else ""
        raise RunError(f"ring: a process ended before its time: {' '.join(words.split())[-500:]}")
    return line


def _say(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
