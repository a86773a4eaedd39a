"""A flight under the ROS 2 standard for simulators: its client pauses, steps and resets the flight."""

import json
import re
import sys
import textwrap
from pathlib import Path

import numpy as np
import psutil
import pytest
from marking import long
from node_processes import short_scenario
from waiting import exit_code_of, output_of, used

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.fingerprint import as_published
from hsv.flight.scenario import load_scenario

pytestmark = pytest.mark.graph

CLIENT = Path(__file__).parents[1] / "support" / "simulation_client.py"
STOPPED, OK, NOT_FOUND, FAILED, UNSUPPORTED, ALREADY, INCORRECT = 0, 1, 2, 4, 0, 101, 103
SUCCEEDED, CANCELED = 4, 5


@pytest.mark.parametrize(
    ("scenario", "pace", "how"), [("short", 0.2, ["--composed"]), long("short", 0.2, []), long("case1", 1, [])]
)
def test_pause_steps_reset_and_the_whole_flight_again(processes, scenario, pace, how):
    flown = short_scenario(processes.folder) if scenario == "short" else scenario
    bag = processes.folder / "flown"
    words = (*how, "--bag", bag, "--paused", "--real-time-factor", str(pace), "--no-report")
    run = processes.start("hsv", "run", flown, *words)
    client = processes.start(sys.executable, CLIENT)
    answers = output_of(client)
    assert client.returncode == 0, answers
    told = json.loads(answers.splitlines()[-1])
    assert {10, 20, 24, 25, 26, 31, 32, 33} == {*told["features"]}
    assert (told["at first"], told["pause while stopped"]) == (STOPPED, INCORRECT)
    assert (told["steps at first"], told["at"]) == ([OK, OK, OK], 5)
    assert (told["play while steps are flown"], told["play"]) == (OK, ALREADY)
    assert told["steps of a played flight"] == FAILED
    assert told["step while playing"] == FAILED and told["pause"] == [OK, ALREADY]
    assert told["steps"] == OK and told["to"] == told["from"] + 50
    assert told["entities"] == ["vehicle"] and told["pitch"][0] == pytest.approx(told["pitch"][1], abs=1e-12)
    assert told["unknown entity"] == NOT_FOUND
    done, canceled = told["action"]
    assert done == [SUCCEEDED, OK, 30] and canceled[:2] == [CANCELED, FAILED]
    assert told["scope"] == UNSUPPORTED and told["reset"] == OK and told["after reset"] == STOPPED
    assert told["play again"] == OK

    assert exit_code_of(run) == 0, run.communicate()[0]
    same = fly(assemble_flight(load_scenario(str(flown))))
    assert np.array_equal(same.history.state[told["to"]], told["state"])
    assert flight_fingerprint(Bag(bag)) == same.fingerprint
    if scenario == "case1":
        assert as_published(same.fingerprint, None, "")
    before = Bag(processes.folder / "flown_reset_1")
    states = before.columns("hsv/state")
    assert len(states["step"]) == told["last"] + 1 > told["to"] + 35 and "design.yaml" in before.attachments
    assert_each_has_its_own(before, Bag(bag))


def assert_each_has_its_own(*bags):
    """Assert that every bag has one run, announced before its reference, with the nodes that were ready for it."""
    runs = [list(bag.decode("/hsv/run")) for bag in bags]
    assert [len(run) for run in runs] == [1] * len(bags)
    for bag, [(_, run)] in zip(bags, runs, strict=True):
        assert [(time, reference.step) for time, reference in bag.decode("/hsv/reference")] == [(0, 0)]
        ready = [message for _, message in bag.decode("/hsv/ready")]
        assert len(ready) == 5 and {message.run_id for message in ready} == {run.run_id}
        assert bag.custom_data["run_id"] == run.run_id
    assert len({run.run_id for [(_, run)] in runs}) == len(bags)


@pytest.mark.fuzz
def test_random_requests_are_answered_and_the_flight_goes_on(processes, request):
    count = min(request.config.getoption("--fuzz-inputs"), 300)
    words = ("--bag", processes.folder / "flown", "--paused", "--real-time-factor", "1", "--no-report")
    run = processes.start("hsv", "run", "case1", *words, output=(processes.folder / "said").open("w"))
    fuzz = processes.run(sys.executable, CLIENT.with_name("simulation_fuzz.py"), count)
    said = (processes.folder / "said").read_text()
    assert fuzz.returncode == 0 and run.poll() is None, fuzz.stdout + said
    assert sum(json.loads(fuzz.stdout.splitlines()[-1]).values()) == count
    nodes = [psutil.Process(run.pid), *psutil.Process(run.pid).children(recursive=True)]
    for node in nodes:
        peak = re.search(r"VmHWM:\s*(\d+)", Path(f"/proc/{node.pid}/status").read_text())
        assert int(peak[1]) <= 512 * 1024, node.cmdline()
    assert used([run.pid]) <= 10.0 * count
    assert "Traceback" not in said, said


RESET_BEFORE_A_STEP = textwrap.dedent(
    """
    import rclpy
    from hsv_bringup.flow_executor import BatchExecutor
    from hsv_bringup.recorder import RecorderNode
    from hsv_msgs.msg import Ready, Reference, Run
    from hsv_node.middleware import LATCHED

    words = ["--ros-args", "-p", "controller:=tube_mpc", "-p", "bag.directory:=flown", "-p", "bag.custom_data:=[a=b]"]
    rclpy.init(args=words)
    recorder, others = RecorderNode(), rclpy.create_node("others")
    executor = BatchExecutor()
    executor.add_node(recorder)
    runs, readies, references = (
        others.create_publisher(kind, topic, LATCHED)
        for kind, topic in ((Run, "hsv/run"), (Ready, "hsv/ready"), (Reference, "hsv/reference"))
    )
    while any(publisher.get_subscription_count() == 0 for publisher in (runs, readies, references)):
        executor.spin_once(timeout_sec=0.05)
    for name in ("first", "second"):
        # The nodes receive the announcement of a run before the recorder does.
        readies.publish(Ready(node="notch_filter", run_id=name))
        references.publish(Reference())
        for _ in range(40):
            executor.spin_once(timeout_sec=0.05)
        runs.publish(Run(run_id=name, period=0.02, last_step=10, interface_version=Run.INTERFACE_VERSION))
        for _ in range(40):
            executor.spin_once(timeout_sec=0.05)
    recorder.close()
    """
)


def test_a_reset_before_the_first_step_is_recorded(processes):
    done = processes.run(sys.executable, "-c", RESET_BEFORE_A_STEP)
    assert done.returncode == 0, done.stdout
    for name, run_id in (("flown_reset_1", "first"), ("flown", "second")):
        bag = Bag(processes.folder / name)
        assert bag.custom_data["run_id"] == run_id
        assert [run.run_id for _, run in bag.decode("/hsv/run")] == [run_id]
        assert [ready.run_id for _, ready in bag.decode("/hsv/ready")] == [run_id]
        assert len(bag.messages("/hsv/reference")) == 1


def test_quitting_ends_the_run_as_an_interruption_does(processes):
    program = (
        "import rclpy; from simulation_interfaces.srv import SetSimulationState as S; rclpy.init();"
        "n = rclpy.create_node('c'); c = n.create_client(S, 'hsv/set_simulation_state'); c.wait_for_service();"
        "r = S.Request(); r.state.state = 3; rclpy.spin_until_future_complete(n, c.call_async(r), timeout_sec=5.0)"
    )
    run = processes.start("hsv", "run", "case1", "--no-report", "--real-time-factor", "1")
    processes.run(sys.executable, "-c", program)
    text = output_of(run)
    assert run.returncode == 1 and "plant ended with exit code 130" in text, text
