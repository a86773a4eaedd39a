"""Whatever dies, hangs or is interrupted: the run ends, names the cause, and leaves a readable bag."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
from marking import long
from node_processes import Processes, children, fly_until, recorded_steps, short_scenario
from waiting import output_of, wait_until

from hsv.bags.description import RECORDER, graph
from hsv.bags.reader import Bag
from hsv.graph.standstill import HUNG_AFTER

pytestmark = pytest.mark.graph


ON_DISK = 50
"""Steps."""


def _start_and_fly(processes: Processes, bag: Path, *words: str) -> subprocess.Popen[str]:
    """Start a long flight and return it once some of it is on disk."""
    scenario = short_scenario(processes.folder, duration=10_000, fault=100)
    run = processes.start("hsv", "run", scenario, "--no-report", "--bag", bag, "--real-time-factor", "4", *words)
    fly_until(run, bag, ON_DISK)
    return run


@pytest.mark.parametrize(
    ("name", "number", "reason"),
    [
        case if case[0] == "tube_mpc" else long(*case)
        for node in graph()
        if node is not RECORDER
        for case in (
            (node.name, signal.SIGKILL, "was killed by SIGKILL"),
            (node.name, signal.SIGTERM, "ended with exit code 143"),
        )
    ],
)
def test_a_killed_node_ends_the_run_by_name(processes: Processes, name: str, number: int, reason: str) -> None:
    bag = processes.folder / "broken"
    run = _start_and_fly(processes, bag)
    nodes = children(run.pid)
    assert set(nodes) == {node.name for node in graph()}
    # Asked to end in flight, a node ends in order; the flight is lost all the same.
    os.kill(nodes[name], number)
    output = output_of(run)
    assert run.returncode == 1
    assert output.splitlines()[-1] == f"hsv: error: {bag}: {name} {reason}" and f"{name} {reason}" not in output[:-200]
    assert recorded_steps(bag) >= ON_DISK
    assert (bag / "metadata.yaml").is_file()
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values())


@pytest.mark.long
def test_a_full_disk_loses_the_flight_by_the_recorders_name(processes: Processes) -> None:
    # Bytecode of what is imported after the disk is full would be cut, too.
    processes.environment["PYTHONDONTWRITEBYTECODE"] = "1"
    bag = processes.folder / "full"
    run = _start_and_fly(processes, bag)
    full = (bag / "full_0.mcap").stat().st_size // 2
    for pid in (run.pid, children(run.pid)["recorder"]):
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (full, resource.RLIM_INFINITY))
    output = output_of(run)
    assert run.returncode == 1
    assert "full_0.mcap: cannot be repaired: File too large" in output
    assert "recorder ended with exit code 2: recorder: error: " in output.splitlines()[-1]
    assert output.count("recorder: error: ") == output.count("cannot be written: File too large") == 1
    assert [file.name for file in bag.iterdir()] == ["full_0.mcap"]
    assert recorded_steps(bag) >= ON_DISK


@pytest.mark.long
def test_a_bag_that_is_removed_in_flight_ends_the_run_at_once(processes: Processes) -> None:
    bag = processes.folder / "removed"
    run = _start_and_fly(processes, bag)
    shutil.rmtree(bag)
    output = output_of(run)
    assert run.returncode == 1
    said = f"recorder: error: {bag}/removed_0.mcap: cannot be written: No such file or directory"
    assert output.splitlines()[-1] == f"hsv: error: recorder ended with exit code 2: {said}"
    assert not bag.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, long(signal.SIGHUP), long(signal.SIGTERM)])
def test_interrupt_ends_all_and_closes_the_bag(processes: Processes, number: int) -> None:
    bag, temporary = processes.folder / "interrupted", processes.folder / "temporary"
    temporary.mkdir()
    processes.environment["TMPDIR"] = str(temporary)
    run = _start_and_fly(processes, bag)
    nodes = children(run.pid)
    if number == signal.SIGTERM:
        _refuse_to_disturb(processes, bag)
    run.send_signal(number)
    output = output_of(run)
    assert run.returncode == 130
    assert output.splitlines()[-1] == f"hsv: error: interrupted; the steps flown so far are in {bag}"
    assert Bag(bag).complete
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values()) and not list(temporary.iterdir())


@pytest.mark.long
def test_a_run_that_is_interrupted_before_its_first_step_leaves_no_bag(processes: Processes) -> None:
    bag = processes.folder / "waiting"
    run = processes.start("hsv", "run", "case1", "--external", "--composed", "--bag", bag)
    # The recorder has its file, and waits with all others for a controller that nobody starts.
    wait_until(lambda: (bag / "waiting_0.mcap").exists(), [run.pid])
    run.send_signal(signal.SIGINT)
    output = output_of(run)
    assert run.returncode == 130 and output.splitlines()[-1] == "hsv: error: interrupted"
    assert not bag.exists()


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


@pytest.mark.long
def test_nodes_do_not_outlive_a_killed_launcher(processes: Processes) -> None:
    run = _start_and_fly(processes, processes.folder / "orphaned")
    nodes = children(run.pid)
    run.kill()
    run.wait()
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in nodes.values()), nodes.values())


@pytest.mark.long
@pytest.mark.parametrize("name", ["notch_filter", "plant"])
def test_a_hung_node_is_named_and_ends_the_run(processes: Processes, name: str) -> None:
    bag = processes.folder / "hung"
    # Longer than it takes to call a process hung: that is said before.
    run = _start_and_fly(processes, bag, "--step-timeout", "6")
    pid = children(run.pid)[name]
    os.kill(pid, signal.SIGSTOP)
    try:
        output = output_of(run)
    finally:
        if Path(f"/proc/{pid}").exists():
            os.kill(pid, signal.SIGCONT)
    assert run.returncode == 1
    assert f"{name}: [WARN] hangs: no progress for 5 s" in output
    assert ("plant hangs: no progress for 6." if name == "plant" else f"no answer from {name}") in output
    assert Bag(bag).complete


@pytest.mark.long
def test_a_node_that_hangs_at_its_start_is_named_and_ends_the_run(processes: Processes) -> None:
    scenario = short_scenario(processes.folder)
    run = processes.start("hsv", "run", scenario, "--no-report", "--step-timeout", "6")
    wait_until(lambda: "tube_mpc" in children(run.pid), [run.pid])
    os.kill(children(run.pid)["tube_mpc"], signal.SIGSTOP)
    output = output_of(run)
    assert run.returncode == 1
    assert "tube_mpc hangs: no progress for 6." in output


@pytest.mark.long
def test_a_run_that_stands_still_as_a_whole_goes_on(processes: Processes) -> None:
    """As on a machine so busy that nothing of it gets to run, or one that sleeps."""
    bag = processes.folder / "slept"
    run = _start_and_fly(processes, bag, "--step-timeout", "3")
    pids = [run.pid, *children(run.pid).values()]
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    time.sleep(HUNG_AFTER + 0.5)
    before = recorded_steps(bag)
    for pid in pids:
        os.kill(pid, signal.SIGCONT)
    wait_until(lambda: recorded_steps(bag) > before + ON_DISK, [run.pid], lambda: recorded_steps(bag))
    run.send_signal(signal.SIGINT)
    output = output_of(run)
    assert run.returncode == 130 and "hangs" not in output
