"""The measurements of ``hsv bench``: ratios of two run times."""

from __future__ import annotations

import ctypes
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from hsv.bags.description import PLANT, NodeDescription, graph
from hsv.bags.parameter_sections import ParameterSections
from hsv.base.errors import RunError
from hsv.core import ffi, lanes, lib, loop_memory
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import make_executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.sample_runner import sample_runner
from hsv.flight.campaign.store import ResultStore
from hsv.flight.closed_loop import Components, flight_struct, fly
from hsv.flight.fingerprint import fingerprint
from hsv.flight.history import History
from hsv.flight.scenario import load_scenario
from hsv.graph.launcher import Launcher, executable, parameter_arguments
from hsv.graph.preparation import prepare

FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-ffp-contract=off")
"""Fastest flags of the C compiler that keep all bits; fused multiply-adds, which round only once, are excluded."""

_PERIOD = 0.02


@dataclass(frozen=True)
class Figure:
    """A measured ratio: the time of our code divided by the time of the reference, ``theirs``."""

    name: str
    what: str
    """Description of the measured work"""
    against: str
    """Description of the work with which it is compared"""
    ours: tuple[float, ...]
    """Times (s) of the measured work, one per pair of runs"""
    theirs: tuple[float, ...]
    """Times (s) of the other work, in the same order"""
    limit: float
    """Largest ratio that the project promises"""
    note: str = ""

    @property
    def ratio(self) -> float:
        """Median of the ratios of ``ours`` to ``theirs``."""
        return float(np.median(np.divide(self.ours, self.theirs)))

    @property
    def spread(self) -> tuple[float, float]:
        """10th and 90th percentile of the ratios of ``ours`` to ``theirs``."""
        low, high = np.percentile(np.divide(self.ours, self.theirs), (10.0, 90.0))
        return float(low), float(high)

    @property
    def worse(self) -> bool:
        """Whether the ratio is above the limit."""
        return self.ratio > self.limit

    @property
    def verdict(self) -> str:
        """Text on whether the ratio is within the limit."""
        limit = f"at most {self.limit:g}"
        return f"WORSE than the limit, {limit}" if self.worse else f"{limit}, as promised"

    def as_dict(self, group: str) -> dict[str, Any]:
        """Return the figure with all times, for JSON."""
        judged = {"ratio": self.ratio, "spread": self.spread, "verdict": self.verdict}
        return {**asdict(self), "group": group, **judged}


def interleaved(
    ours: Callable[[], object],
    theirs: Callable[[], object],
    repeats: int,
    clock: Callable[[], float] = time.thread_time,
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Run two jobs alternately, ``repeats`` times each after one discarded run; return the times (s) of both.

    The default clock is the processor time of this thread, which other programs influence little.
    """
    times: list[list[float]] = []
    for _ in range(repeats + 1):
        pair = []
        for job in (ours, theirs):
            started = clock()
            job()
            pair.append(clock() - started)
        times.append(pair)
    first, second = zip(*times[1:], strict=True)
    return first, second


def readable(seconds: float) -> str:
    """Return a time as text with three digits, in s, ms or us."""
    scale, unit = (1.0, "s") if seconds >= 1.0 else (1e3, "ms") if seconds >= 1e-3 else (1e6, "us")
    return f"{scale * seconds:.3g} {unit}"


def groups(scale: float = 1.0) -> dict[str, Callable[[], list[Figure]]]:
    """Return a function for each group of measurements, by name; ``scale`` multiplies the repetitions (at least 2)."""

    def times(number: int) -> int:
        return max(2, round(scale * number))

    return {
        "in_process": lambda: against_c(times(40)),
        "startup": lambda: against_imports(times(10)),
        "graph": lambda: against_ring(times(5)),
        "montecarlo": lambda: corners(times(3), max(os.cpu_count() or 1, 2)),
    }


def machine() -> str:
    """Return a line of text with processor, cores, system, Python version and load of this machine."""
    info = Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.partition(": ")[2] for line in info if line.startswith("model name")]
    system = f"{platform.system()}, Python {platform.python_version()}, load average {os.getloadavg()[0]:.1f}"
    return f"{[*models, platform.machine()][0]}, {os.cpu_count()} cores, {system}"


def c_flight(components: Components) -> Callable[[], History]:
    """Return a function that simulates ``components`` by the C loop alone, compiled here for this processor.

    The equipment must be ideal, and controller and nominal law those of the core. The function returns
    the history; its next call overwrites this history.

    Raises:
        RunError: There is no C compiler, or the build failed.
    """
    core = Path(str(files("hsv.core")))
    if (compiler := shutil.which("cc")) is None:
        raise RunError("C build: no C compiler cc on PATH, expected one (sudo apt-get install gcc)")
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        library = Path(folder, "flight.so")
        command = [compiler, "-std=gnu99", *FLAGS, "-shared", "-fPIC", "-o", str(library)]
        _run(*command, str(core / "scalar.c"), str(core / "complex.c"))
        loop = ctypes.CDLL(str(library)).hsv_fly_single
    loop.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_int]
    history = History.empty(components.plant.steps + 1, estimated=False)
    flight, memory = flight_struct(components, history), loop_memory(1)

    def fly() -> History:
        flights = ffi.new("hsv_flight *[]", [flight.pointer])
        loop(int(ffi.cast("intptr_t", flights)), memory.ctypes.data, 0, len(history.signals), lib.SENSE | lib.ACT)
        return history

    return fly


def against_c(repeats: int) -> list[Figure]:
    """Measure the simulation of Case 1, called from Python, against the C loop alone."""
    components = assemble_flight(load_scenario("case1"))
    in_c = c_flight(components)
    ours, theirs = interleaved(lambda: fly(components), in_c, repeats)
    note = "the same bits" if fly(components).fingerprint == fingerprint(in_c().signals) else "OTHER bits"
    what, against = "Case 1, 200 s, called from Python", f"its loop in C alone, cc {' '.join(FLAGS)}"
    return [Figure("in_process", what, against, ours, theirs, 1.3, note)]


def against_imports(repeats: int) -> list[Figure]:
    """Measure processor times of hsv --help and hsv simulate case1 against a Python process that only imports numpy.

    Raises:
        RunError: There is no ``hsv`` on the search path, or a command failed.
    """
    if (command := shutil.which("hsv")) is None:
        raise RunError("no hsv on the search path: expected it to be installed")

    def clock() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def import_numpy() -> None:
        _run(sys.executable, "-c", "import numpy")

    figures = []
    for name, words, limit in (("help", ["--help"], 1.8), ("simulate", ["simulate", "case1"], 6.0)):
        ours, theirs = interleaved(lambda words=words: _run(command, *words), import_numpy, repeats, clock)  # type: ignore[misc]
        what = f"processor time of hsv {' '.join(words)}"
        figures.append(Figure(f"startup_{name}", what, "python -c 'import numpy'", ours, theirs, limit))
    return figures


def corners(repeats: int, workers: int) -> list[Figure]:
    """Measure the wall time of the 1024 corners of Case 1 against 1024 flights of the C loop, on the same workers."""
    campaign = plan("case1", method="corners")
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder, make_executor(workers) as flying:

        def fly_campaign() -> None:
            path = Path(folder, "corners.parquet")
            path.unlink(missing_ok=True)
            run_campaign(campaign, ResultStore(path, campaign), flying)

        def fly_in_c() -> None:
            list(flying.fly(_fly_c, campaign.text, range(len(campaign.batches))))

        ours, theirs = interleaved(fly_campaign, fly_in_c, repeats, time.perf_counter)
    what = f"1024 corners of Case 1, {workers} workers, metrics and file included"
    against = f"as many flights of the loop in C alone, {' '.join(FLAGS)}, on as many workers"
    return [Figure("corners_c", what, against, ours, theirs, 0.6, f"{lanes()} flights side by side")]


@cache
def _c_case1() -> Callable[[], History]:
    return c_flight(assemble_flight(load_scenario("case1")))


def _fly_c(text: str, batch: int) -> bytes:
    for _ in sample_runner(text).campaign.flights(batch):
        _c_case1()()
    return b""


def against_ring(repeats: int, duration: float = 60.0) -> list[Figure]:
    """Measure a lap of the ROS 2 graph against a lap of bare processes that pass the same messages in a ring."""
    pairs = [(graph_lap(duration), ring_lap(round(duration / _PERIOD))) for _ in range(repeats)]
    ours, theirs = zip(*pairs, strict=True)
    what, against = "lap of the graph, separate processes, recorded", "bare ring, EventsExecutor, same recorder"
    return [Figure("graph", what, against, ours, theirs, 1.0)]


def graph_lap(duration: float) -> float:
    """Fly the first ``duration`` (s) of Case 1 over DDS, with recording; return the mean wall time (s) of a lap.

    Raises:
        RunError: A process ended before its time, or the workspace is not built.
    """
    times: dict[int, float] = {}
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        prepared = prepare("case1", bag=Path(folder, "bag"))
        shortened = Path(folder, "duration.yaml")
        shortened.write_text(ParameterSections({"duration": float(duration)}).to_yaml(), encoding="utf-8")
        arguments = parameter_arguments([*prepared.parameter_files, shortened])

        def on_step(step: int) -> None:
            times[step] = time.perf_counter()

        with Launcher(prepared.nodes, arguments, on_step, lambda node, text: None) as launcher:
            launcher.wait()
    first, last = min(times), max(times)
    return (times[last] - times[first]) / (last - first)


def ring_lap(laps: int) -> float:
    """Pass the graph's messages ``laps`` times around a recorded ring of bare processes; return the time (s) of a lap.

    Raises:
        RunError: A process ended before its time, or the workspace is not built.
    """
    program = str(executable(NodeDescription("ring", "hsv_bringup", "ring", (), ())))
    processes: dict[str, subprocess.Popen[str]] = {}

    def read_line(process: subprocess.Popen[str]) -> str:
        assert process.stdout and process.stderr
        if not (line := process.stdout.readline()):
            raise RunError(f"ring: a process ended before its time: {process.stderr.read()[-500:].strip()}")
        return line

    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        try:
            for name in (node.name for node in graph()):
                command, pipe = [program, name, str(laps), str(Path(folder, "bag"))], subprocess.PIPE
                processes[name] = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
            for process in processes.values():
                read_line(process)
            plant = processes[PLANT.name]
            assert plant.stdin
            print(file=plant.stdin, flush=True)
            return float(read_line(plant)) / laps
        finally:
            for process in processes.values():
                process.kill()
                process.communicate()


def _run(*words: str) -> None:
    ran = subprocess.run(words, capture_output=True, text=True)
    if ran.returncode:
        raise RunError(f"{' '.join(words)} failed: {ran.stderr.strip()[-500:]}")
