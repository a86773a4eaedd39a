"""The processor that the nodes of a flight share."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from hsv.bags.parameter_sections import ParameterSections
from hsv.graph import placement
from hsv.graph.exclusive import claim_processor, claim_topic
from hsv.graph.launcher import Launcher, parameter_arguments
from hsv.graph.placement import CHAIN, share_processor
from hsv.graph.preparation import prepare

ALLOWED = os.sched_getaffinity(0)

several_processors = pytest.mark.skipif(len(ALLOWED) < 2, reason="this machine lends one processor only")

TWO_THREADS = "import sys, threading; threading.Thread(target=sys.stdin.read).start(); print(flush=True)"


def processors(pid: int) -> list[set[int]]:
    """Return the processors that each thread of a process may use.

    Raises:
        OSError: The process, or one of its threads, has ended meanwhile.
    """
    return [os.sched_getaffinity(int(thread.name)) for thread in Path(f"/proc/{pid}/task").iterdir()]


@pytest.fixture(autouse=True)
def _own_claims(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Claims that no flight of another test run has, and that take no processor from it."""
    place = f"/{os.getpid()}/{request.node.name}"
    monkeypatch.setattr(placement, "claim_processor", lambda number: claim_topic(number, place))


@pytest.fixture
def pids() -> Iterator[list[int]]:
    """Two processes of two threads each."""
    with ExitStack() as stack:
        command = [sys.executable, "-c", TWO_THREADS]
        pipe = subprocess.PIPE
        started = [stack.enter_context(subprocess.Popen(command, stdin=pipe, stdout=pipe)) for _ in range(2)]
        for process in started:
            process.stdout.readline()
        yield [process.pid for process in started]
        for process in started:
            process.stdin.close()


@several_processors
def test_all_threads_share_a_processor_that_no_other_flight_gets(pids: list[int]) -> None:
    with share_processor(pids) as held:
        shared = [threads for pid in pids for threads in processors(pid)]
        assert held and len(shared) == 4 and all(len(threads) == 1 for threads in shared)
        (processor,) = set.union(*shared)
        assert processor in ALLOWED
        assert placement.claim_processor(processor) is None


@several_processors
def test_where_other_flights_have_all_processors_nothing_changes(pids: list[int]) -> None:
    with ExitStack() as others:
        for processor in ALLOWED:
            others.enter_context(placement.claim_processor(processor))
        assert share_processor(pids) is None
        assert all(threads == ALLOWED for pid in pids for threads in processors(pid))


def test_one_processor_is_left_to_the_system(pids: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    assert share_processor(pids) is None
    monkeypatch.undo()
    assert all(threads == ALLOWED for pid in pids for threads in processors(pid))


@several_processors
def test_a_process_that_has_ended_is_no_error(pids: list[int]) -> None:
    ended = subprocess.Popen(["true"])
    ended.wait()
    with share_processor([ended.pid, *pids]):
        assert all(len(threads) == 1 for pid in pids for threads in processors(pid))


def test_two_claims_of_a_processor() -> None:
    # Of a processor that no machine has: those that it has may be in use by flights.
    with claim_processor(100_000) as held:
        assert held and claim_processor(100_000) is None
    again = claim_processor(100_000)
    assert again
    again.close()


@pytest.mark.graph
@several_processors
def test_in_flight_the_nodes_of_the_chain_share_a_processor(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name, value in ros_environment.items():
        monkeypatch.setenv(name, value)
    found: list[dict[str, set[frozenset[int]]]] = []
    prepared = prepare("case1", bag=tmp_path / "bag")
    shortened = tmp_path / "duration.yaml"
    shortened.write_text(ParameterSections({"duration": 40.0}).to_yaml(), encoding="utf-8")

    def look(step: int) -> None:
        # Not the first report, at which the launcher places the nodes. At the last ones, some may be gone.
        if step:
            with suppress(OSError):
                found.append(
                    {
                        process.description.name: {frozenset(threads) for threads in processors(process.popen.pid)}
                        for process in launcher._processes
                    }
                )

    arguments = parameter_arguments([*prepared.parameter_files, shortened])
    with Launcher(prepared.nodes, arguments, look, lambda node, text: None) as launcher:
        launcher.wait()
    last = found[-1]
    together = set.union(*(last[name] for name in CHAIN))
    assert len(together) == 1 and len(next(iter(together))) == 1
    assert last["recorder"] == last["nominal_trajectory"] == {frozenset(ALLOWED)}
