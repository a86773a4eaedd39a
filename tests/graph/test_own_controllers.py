"""Custom controllers over DDS: a class, a C function, and a node that knows only the messages."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from marking import long
from node_processes import Processes, fly_until, last_line, short_scenario
from ros_domain import own_environment
from waiting import exit_code_of, output_of, wait_until

from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps

pytestmark = pytest.mark.graph

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENARIOS = {"lqr": "lqr/lqr.toml", "node": "node/regulator.toml"}
SUPPORT = Path(__file__).parents[1] / "support"
WRONG = SUPPORT / "wrong_controller.py"
WRONG_STEP = 100
SHORT = 'extends = "{example}"\nfault = []\nduration = "{duration} s"\n{more}\n'


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Build the example's node in its own workspace; return the environment variables that find all examples."""
    folder = tmp_path_factory.mktemp("workspace")
    shutil.copytree(EXAMPLES / "node", folder / "src", ignore=shutil.ignore_patterns("build", "install", "log"))
    words = ["colcon", "--log-base", "log", "build", "--base-paths", "src"]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)
    prefix = folder / "install" / "hsv_example_node"
    [site] = prefix.glob("lib/python3*/site-packages")
    # The class and the C function are found by their paths; nothing is installed into the tests' environment.
    modules = (site, EXAMPLES / "lqr", SUPPORT)
    return {
        "AMENT_PREFIX_PATH": os.pathsep.join((str(prefix), os.environ["AMENT_PREFIX_PATH"])),
        "PYTHONPATH": os.pathsep.join((*map(str, modules), os.environ.get("PYTHONPATH", ""))),
    }


@pytest.fixture
def processes(installed, tmp_path):
    with own_environment() as environment:
        started = Processes(environment | installed, tmp_path)
        yield started
        started.stop()


def scenario(folder, example, more="", duration=11.0):
    """Write a shortened scenario of an example and return its path."""
    path = folder / f"{example}.toml"
    path.write_text(SHORT.format(example=EXAMPLES / SCENARIOS[example], more=more, duration=duration))
    return path


@pytest.mark.long
@pytest.mark.parametrize("place", ["hsv_lqr:Lqr", "lqr_in_c:LqrInC"])
def test_a_class_and_a_function_in_c_fly_as_in_process(processes, place):
    path = scenario(processes.folder, "lqr", f'controller = "{place}"')
    simulated = processes.run("hsv", "simulate", path)
    assert simulated.returncode == 0, simulated.stdout
    [fingerprint] = [word for word in simulated.stdout.split() if word.startswith("v1:")]
    for words in ((), ("--composed",)):
        bag = processes.fly(path, f"flown{''.join(words)}", *words)
        assert f"{flight_fingerprint(bag)}" == fingerprint
        assert "tube" not in " ".join(bag.topics) and bag.custom_data["controller"] == place
    for words in (("--rerun",), ("--over-dds",)):
        replayed = processes.run("hsv", "replay", bag.folder, "--trust", *words)
        assert replayed.returncode == 0 and "identical in every byte" in replayed.stdout, replayed.stdout


@pytest.mark.long
def test_a_node_flies_started_by_the_bench_or_by_hand_for_many_runs(processes):
    path = scenario(processes.folder, "node")
    bags = [processes.fly(path, "started")]
    # The controller is started late; all other nodes wait for it.
    run = processes.start(
        *("hsv", "run", path, "--external", "--composed", "--no-report", "--step-timeout", "30"),
        *("--bag", processes.folder / "late"),
    )
    wait_until(lambda: (processes.folder / "late" / "late_0.mcap").exists(), [run.pid])
    regulator = processes.start("ros2", "run", "hsv_example_node", "regulator", "--ros-args", "-r", "__node:=any_name")
    said = output_of(run)
    assert run.returncode == 0, said
    bags += [Bag(processes.folder / "late"), processes.fly(path, "next", "--external")]
    assert regulator.poll() is None
    assert len({flight_fingerprint(bag) for bag in bags}) == 1
    for words in ((), ("--rerun",)):
        replayed = processes.run("hsv", "replay", bags[1].folder, *words)
        assert replayed.returncode == 0, replayed.stdout
        lines = [line for line in replayed.stdout.splitlines() if "identical in every byte" in line]
        assert len(lines) == 4, replayed.stdout


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("controller", "pace"), [("tube_mpc", "0"), ("node:hsv_example_node/regulator", "1")])
def test_commands_in_flight_beside_four_busy_processes(processes, controller, pace):
    busy = [processes.start(sys.executable, "-c", "while True: pass") for _ in range(4)]
    path = short_scenario(processes.folder, duration=3600, fault=6)
    path.write_text(f'controller = "{controller}"\n{path.read_text()}')
    bags = [processes.folder / name for name in "abc"]
    for bag in bags:
        flight = processes.start("hsv", "run", path, "--bag", bag, "--real-time-factor", pace, "--no-report")
        fly_until(flight, bag, 50)
        done = processes.run("hsv", "command", "86000 ft", "8120 ft/s", "--json")
        assert done.returncode == 0, done.stdout
        fly_until(flight, bag, json.loads(last_line(done))["step"] + 600)
        flight.send_signal(signal.SIGINT)
        said = output_of(flight)
        assert flight.returncode == 130, said
    for process in busy:
        process.kill()
    for bag in bags:
        replayed = processes.run("hsv", "replay", bag, "--rerun")
        assert replayed.returncode == 0 and "identical in every byte" in replayed.stdout, replayed.stdout


@pytest.mark.parametrize(
    ("how", "words"),
    [
        long("killed", "; no answer from /regulator\n"),
        long("hung", "; no answer from /regulator\n"),
        long(
            "wrong_step",
            f"/regulator answered step {WRONG_STEP - 1} at 2.00 s on /hsv/command, expected step {WRONG_STEP}",
        ),
        ("nan", f"/regulator, step {WRONG_STEP}: elevator_deflection = nan, expected a finite number"),
    ],
)
def test_a_node_that_goes_wrong_is_named_and_the_bag_is_whole(processes, how, words):
    path = scenario(processes.folder, "node", 'controller = "node:"')
    foreign = processes.start(sys.executable, WRONG, how, str(WRONG_STEP))
    done = processes.run("hsv", "run", path, "--composed", "--no-report", "--bag", processes.folder / how)
    assert done.returncode == 1 and words in done.stdout, done.stdout
    assert "Traceback" not in done.stdout
    bag = Bag(processes.folder / how)
    # A command that is not a number is recorded but not applied.
    assert bag.complete and complete_steps(bag) == WRONG_STEP + (how == "nan")
    assert (exit_code_of(foreign) == -9) if how == "killed" else foreign.poll() is None


@pytest.mark.long
def test_a_controller_that_is_slow_is_named(processes):
    path = scenario(processes.folder, "lqr", 'controller = "wrong_controller:SlowLqr"')
    words = ("--step-timeout", "3", "--no-report", "--bag", processes.folder / "slow")
    done = processes.run("hsv", "run", path, *words)
    assert done.returncode == 1 and "; all nodes answer, controller last\n" in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('controller = "node:hsv_example_node"', "expected node:package/executable, or node: alone"),
        long('controller = "node:nowhere/regulator"', "no executable regulator of package nowhere"),
        long('controller = "hsv_lqr:Nothing"', "cannot be loaded, AttributeError"),
        long("[regulator]\ngain = 1.0", "regulator: unknown table, expected none: a node brings its own parameters"),
    ],
)
def test_what_cannot_fly_is_refused_in_a_line(processes, more, words):
    done = processes.run("hsv", "run", scenario(processes.folder, "node", more), "--bag", processes.folder / "bag")
    assert done.returncode == 2 and words in last_line(done) and len(done.stdout.splitlines()) == 1, done.stdout
    assert not (processes.folder / "bag").exists()


@pytest.mark.long
def test_two_controllers_end_the_run(processes):
    # The flight is paced, so that the second controller joins before its end, however long the start takes.
    path = scenario(processes.folder, "node", 'controller = "node:"', duration=200.0)
    for name in ("one", "two"):
        processes.start("ros2", "run", "hsv_example_node", "regulator", "--ros-args", "-r", f"__node:={name}")
    paced = ("--real-time-factor", "2", "--step-timeout", "30")
    done = processes.run("hsv", "run", path, "--composed", "--no-report", *paced, "--bag", processes.folder / "bag")
    # If the second joins in flight, its answer may come before DDS identifies the sender.
    assert done.returncode == 1, done.stdout
    [said] = [line for line in done.stdout.splitlines() if "publish /hsv/command: expected one controller" in line]
    assert "/one" in said or "/two" in said
