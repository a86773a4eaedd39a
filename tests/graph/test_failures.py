"""Whatever dies, hangs or is interrupted: the run ends, names the cause, and leaves a readable bag."""

from __future__ import annotations

import os
import resource
import signal
import time
from pathlib import Path

import pytest
from node_processes import Processes, children, short_scenario

from hsv.errors import RecordingError
from hsv.graph.description import PLANT, RECORDER, graph
from hsv.recording.reader import Bag

pytestmark = pytest.mark.graph


ON_DISK = 50
"""Steps."""


def _start_and_fly(processes: Processes, bag: Path, pace: str = "1"):  # type: ignore[no-untyped-def]
    """Start a long flight and return it once some of it is on disk."""
    scenario = short_scenario(processes.folder, duration=120, fault=100)
    run = processes.start("hsv", "run", scenario, "--no-report", "--bag", bag, "--real-time-factor", pace)
    deadline = time.monotonic() + 60.0
    while _recorded(bag) < ON_DISK:
        assert time.monotonic() < deadline and run.poll() is None, "no flight"
        time.sleep(0.05)
    return run


def _recorded(bag: Path) -> int:
    try:
        return Bag(bag).topics["/hsv/state"].count
    except RecordingError:
        return 0  # not begun yet


@pytest.mark.parametrize("name", [node.name for node in graph() if node is not RECORDER])
def test_a_killed_node_ends_the_run_by_name(processes: Processes, name: str) -> None:
    bag = processes.folder / "broken"
    run = _start_and_fly(processes, bag)
    nodes = children(run.pid)
    assert set(nodes) == {node.name for node in graph()}
    killed = time.monotonic()
    # Asked to end in flight, the plant ends in order; the flight is lost all the same.
    asked = name == PLANT.name
    os.kill(nodes[name], signal.SIGTERM if asked else signal.SIGKILL)
    output, _ = run.communicate(timeout=30.0)
    assert time.monotonic() - killed < 5.0
    assert run.returncode == 1
    assert f"{bag}: {name} {'ended with exit code 143' if asked else 'was killed by SIGKILL'}" in output
    assert _recorded(bag) >= ON_DISK
    assert (bag / "metadata.yaml").is_file()
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values())


def test_a_full_disk_loses_the_flight_by_the_recorders_name(processes: Processes) -> None:
    # Bytecode of what is imported after the disk is full would be cut, too.
    processes.environment["PYTHONDONTWRITEBYTECODE"] = "1"
    bag = processes.folder / "full"
    run = _start_and_fly(processes, bag)
    full = (bag / "full_0.mcap").stat().st_size // 2
    for pid in (run.pid, children(run.pid)["recorder"]):
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (full, resource.RLIM_INFINITY))
    output, _ = run.communicate(timeout=30.0)
    assert run.returncode == 1
    assert "full_0.mcap: cannot be mended: File too large" in output
    assert "recorder ended with exit code 2. Its last words:" in output
    assert output.count("recorder: error: ") == output.count("cannot be written: File too large") == 1
    assert [file.name for file in bag.iterdir()] == ["full_0.mcap"]
    assert _recorded(bag) >= ON_DISK


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_ends_all_and_closes_the_bag(processes: Processes, number: int) -> None:
    bag, temporary = processes.folder / "interrupted", processes.folder / "temporary"
    temporary.mkdir()
    processes.environment["TMPDIR"] = str(temporary)
    run = _start_and_fly(processes, bag)
    nodes = children(run.pid)
    if number == signal.SIGINT:
        _refuse_to_disturb(processes, bag)
    run.send_signal(number)
    output, _ = run.communicate(timeout=15.0)
    assert run.returncode == 130
    assert "interrupted" in output
    assert Bag(bag).complete
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values()) and not list(temporary.iterdir())


def _refuse_to_disturb(processes: Processes, bag: Path) -> None:
    """Neither a second run nor a recovery touches a flight and its bag."""
    for words, refused in (
        (("run", "case1", "--bag", bag), "exists already"),
        (("recover", bag), "is being recorded"),
        (("run", "case1", "--bag", processes.folder / "other"), "another run has ROS_DOMAIN_ID="),
    ):
        again = processes.run("hsv", *words)
        assert again.returncode == (1 if "another" in refused else 2), again.stdout
        assert refused in again.stdout
    assert not (processes.folder / "other").exists()


def test_nodes_do_not_outlive_a_killed_launcher(processes: Processes) -> None:
    run = _start_and_fly(processes, processes.folder / "orphaned")
    nodes = children(run.pid)
    run.kill()
    run.wait()
    deadline = time.monotonic() + 10.0
    while any(Path(f"/proc/{pid}").exists() for pid in nodes.values()):
        assert time.monotonic() < deadline, "a node flies on without its launcher"
        time.sleep(0.1)


def test_a_hung_node_is_named(processes: Processes) -> None:
    scenario = short_scenario(processes.folder, duration=120, fault=100)
    bag = processes.folder / "hung"
    run = processes.start(
        "hsv", "run", scenario, "--no-report", "--bag", bag, "--real-time-factor", "1", "--step-timeout", "1"
    )
    mcap = bag / "hung_0.mcap"
    deadline = time.monotonic() + 60.0
    while not mcap.exists() or mcap.stat().st_size < 150_000:
        assert time.monotonic() < deadline and run.poll() is None, "no flight"
        time.sleep(0.05)
    pid = children(run.pid)["notch_filter"]
    os.kill(pid, signal.SIGSTOP)
    try:
        output, _ = run.communicate(timeout=30.0)
    finally:
        if Path(f"/proc/{pid}").exists():
            os.kill(pid, signal.SIGCONT)
    assert run.returncode == 1
    assert "no answer from notch_filter" in output
    assert Bag(bag).complete
