"""If a process dies, hangs or is interrupted, the run ends, names the cause, and leaves a readable bag."""

import os
import re
import resource
import shutil
import signal
import time
from pathlib import Path

import pytest
from marking import long
from node_processes import children, fly_until, recorded_steps, short_scenario
from waiting import output_of, wait_until

from hsv.bags.description import RECORDER, TOPICS, graph
from hsv.bags.reader import Bag
from hsv.graph.standstill import HUNG_AFTER
from hsv_plant.plant import MAX_AHEAD

pytestmark = pytest.mark.graph


ON_DISK = 50
"""Steps that must be on disk before a process is disturbed."""


def _start_and_fly(processes, bag, *words):
    """Start a long flight and return its process when some steps are on disk."""
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
def test_a_killed_node_ends_the_run_by_name(processes, name, number, reason):
    bag = processes.folder / "broken"
    run = _start_and_fly(processes, bag)
    nodes = children(run.pid)
    assert set(nodes) == {node.name for node in graph()}
    # SIGTERM lets a node end in order, but the flight is lost in either case.
    os.kill(nodes[name], number)
    output = output_of(run)
    assert run.returncode == 1
    assert output.splitlines()[-1] == f"hsv: error: {bag}: {name} {reason}" and f"{name} {reason}" not in output[:-200]
    assert recorded_steps(bag) >= ON_DISK
    assert (bag / "metadata.yaml").is_file()
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values())


@pytest.mark.long
@pytest.mark.parametrize("seconds", [0.3, 1.7])
def test_a_killed_recorder_loses_what_was_on_its_way_to_the_disk_and_nothing_else(processes, seconds):
    bag = processes.folder / "killed"
    run = _start_and_fly(processes, bag, "--verbose")
    time.sleep(seconds)
    os.kill(children(run.pid)["recorder"], signal.SIGKILL)
    output = output_of(run)
    assert run.returncode == 1 and output.splitlines()[-1] == f"hsv: error: {bag}: recorder was killed by SIGKILL"
    flown = int(re.search(r"\[plant\]: run \w+ broken off at t = [\d.]+ s, step (\d+)", output)[1])
    recorded = Bag(bag)
    steps = min(len(recorded.messages(topic)) for topic in TOPICS)
    assert recorded.complete and flown - MAX_AHEAD < steps
    for topic in TOPICS:
        assert recorded.times(topic)[:steps].tolist() == [20_000_000 * step for step in range(steps)], topic


@pytest.mark.long
def test_a_full_disk_loses_the_flight_by_the_recorders_name(processes):
    # Bytecode of modules imported after the disk is full would be cut, too.
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
def test_a_bag_that_is_removed_in_flight_ends_the_run_at_once(processes):
    bag = processes.folder / "removed"
    run = _start_and_fly(processes, bag)
    shutil.rmtree(bag)
    output = output_of(run)
    assert run.returncode == 1
    said = f"recorder: error: {bag}/removed_0.mcap: cannot be written: No such file or directory"
    assert output.splitlines()[-1] == f"hsv: error: recorder ended with exit code 2: {said}"
    assert not bag.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, long(signal.SIGHUP), long(signal.SIGTERM)])
def test_interrupt_ends_all_and_closes_the_bag(processes, number):
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
def test_a_run_that_is_interrupted_before_its_first_step_leaves_no_bag(processes):
    bag = processes.folder / "waiting"
    run = processes.start("hsv", "run", "case1", "--external", "--composed", "--bag", bag)
    # The recorder has created its file; all nodes wait for a controller that is never started.
    wait_until(lambda: (bag / "waiting_0.mcap").exists(), [run.pid])
    run.send_signal(signal.SIGINT)
    output = output_of(run)
    assert run.returncode == 130 and output.splitlines()[-1] == "hsv: error: interrupted"
    assert not bag.exists()


def _refuse_to_disturb(processes, bag):
    """Assert that neither a second run nor a recovery disturbs a flight and its bag."""
    for words, refused in (
        (("run", "case1", "--bag", bag), "exists already"),
        (("recover", bag), "is being recorded"),
        (("run", "case1", "--bag", processes.folder / "other"), "another run has ROS_DOMAIN_ID="),
    ):
        again = processes.run("hsv", *words)
        assert again.returncode == 2, again.stdout
        assert refused in again.stdout
    assert not (processes.folder / "other").exists()


@pytest.mark.long
def test_nodes_do_not_outlive_a_killed_launcher(processes):
    run = _start_and_fly(processes, processes.folder / "orphaned")
    nodes = children(run.pid)
    run.kill()
    run.wait()
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in nodes.values()), nodes.values())


@pytest.mark.long
@pytest.mark.parametrize("name", ["notch_filter", "plant"])
def test_a_hung_node_is_named_and_ends_the_run(processes, name):
    bag = processes.folder / "hung"
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
def test_a_run_that_stands_still_as_a_whole_goes_on(processes):
    """All processes stop for a while, as on an overloaded or suspended machine."""
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
