"""The graph with the tools of a full ROS 2 installation; skipped if none is sourced. Run by make test-ros."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from full_installation import COMMANDS, Terminal, needs
from node_processes import Processes, children, recorded_steps, short_scenario
from printed_commands import ROOT, the_printed
from waiting import exit_code_of, output_of, wait_until

from hsv.bags.description import RECORDER, TOPICS, graph
from hsv.bags.reader import Bag
from ros2 import prefixes

pytestmark = pytest.mark.full_ros

LAUNCH = ("ros2", "launch", "hsv_bringup", "sil.launch.py")
PAGE = "docs/installation.md"
REFERENCE = ROOT / "bags" / "reference" / "case1"
COMPRESSED: dict[str, dict[str, Any]] = {
    "file": {"compression_mode": "file"},
    # With a shorter queue rosbag2 drops the messages that it cannot compress in time.
    "message": {"compression_mode": "message", "compression_queue_size": 0},
}
"""Settings of ros2 bag convert by mode of compression: whole files or single messages."""


@pytest.fixture(scope="module", autouse=True)
def installation() -> None:
    for command in COMMANDS:
        needs(command)


def arguments(**values: object) -> list[str]:
    return [f"{name}:={value}" for name, value in values.items()]


def told(processes: Processes, *words: str | Path) -> Any:
    done = processes.run("hsv", *words, "--json")
    assert done.returncode == 0 and done.stdout.startswith("{"), done.stdout  # a warning would come first
    return json.loads(done.stdout)


def test_launch_flies_case_1_with_the_published_fingerprint(shared_processes: Processes) -> None:
    launch = the_printed(PAGE, "ros2 launch hsv_bringup sil.launch.py scenario:=case1")
    done = shared_processes.run("bash", "-c", launch)
    assert done.returncode == 0, done.stdout
    assert "fingerprint  as published" in done.stdout and "ERROR" not in done.stdout
    [bag] = (shared_processes.folder / "bags").glob("case1_*")
    assert told(shared_processes, "info", bag)["as_published"] is True
    assert (bag / "report.html").is_file()


def test_launch_composed_gives_the_same_bytes(shared_processes: Processes) -> None:
    scenario = short_scenario(shared_processes.folder)
    done = shared_processes.run(*LAUNCH, *arguments(scenario=scenario, bag="one", composed="true", report="false"))
    assert done.returncode == 0, done.stdout
    assert not (shared_processes.folder / "one" / "report.html").exists()
    simulated = told(shared_processes, "simulate", scenario)
    assert told(shared_processes, "info", "one")["fingerprint"] == simulated["fingerprint"]


def test_launch_ends_with_1_after_a_lost_flight(processes: Processes) -> None:
    scenario = short_scenario(processes.folder, duration=30, coupling="derived", notch=False)
    done = processes.run(*LAUNCH, *arguments(scenario=scenario, bag="lost", report="false"))
    assert done.returncode == 1, done.stdout
    assert "flight diverged at t = 17." in done.stdout and done.stdout.count("lost: the flight was lost") == 1
    assert Bag(processes.folder / "lost").complete


def fly_for_a_while(processes: Processes, bag: Path) -> subprocess.Popen[str]:
    scenario = short_scenario(processes.folder, duration=10_000, fault=100)
    words = arguments(scenario=scenario, bag=bag, real_time_factor=4, report="false")
    flight = processes.start(*LAUNCH, *words)
    wait_until(lambda: recorded_steps(bag) >= 50 or flight.poll() is not None, [flight.pid])
    assert flight.poll() is None, flight.communicate()[0]
    return flight


@pytest.mark.parametrize("name", ["tube_mpc", RECORDER.name])
def test_launch_ends_with_1_after_a_node_is_killed(processes: Processes, name: str) -> None:
    bag = processes.folder / "killed"
    flight = fly_for_a_while(processes, bag)
    nodes = children(flight.pid)
    assert set(nodes) == {node.name for node in graph()}
    os.kill(nodes[name], signal.SIGKILL)
    output = output_of(flight)
    assert flight.returncode == 1 and f"{bag}: {name} was killed by SIGKILL" in output, output
    assert Bag(bag).complete and recorded_steps(bag) >= 50
    assert not any(Path(f"/proc/{pid}").exists() for pid in nodes.values())


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("scenari:=case1", "scenari: no such argument, did you mean scenario?"),
        ("colour:=red", "colour: no such argument: expected one of scenario, bag, "),
        ("scenario:=nowhere", "scenario 'nowhere': expected a path or one of case1, "),
        ("real_time_factor:=quick", "real_time_factor = 'quick': expected a valid number"),
        ("step_timeout:=0", "step_timeout = 0.0: expected at least 0.1"),
        ("bag:=.", "bag = '.': exists already"),
    ],
)
def test_launch_names_a_wrong_argument_and_starts_nothing(processes: Processes, argument: str, said: str) -> None:
    processes.environment["TMPDIR"] = str(processes.folder / "temporary")
    (processes.folder / "temporary").mkdir()
    done = processes.run(*LAUNCH, argument)
    assert done.returncode == 2, done.stdout
    [line] = [line for line in done.stdout.splitlines() if "[INFO] [launch]" not in line]
    assert line.startswith(f"sil.launch.py: error: {said}")
    assert [path.name for path in processes.folder.rglob("*")] == ["temporary"]


def test_launch_refuses_what_is_no_choice(processes: Processes) -> None:
    done = processes.run(*LAUNCH, "composed:=yes")
    assert done.returncode == 1 and "Valid options are: ('true', 'false')" in done.stdout, done.stdout
    assert not list(processes.folder.iterdir())


def test_launch_describes_every_argument(processes: Processes) -> None:
    done = processes.run("bash", "-c", the_printed(PAGE, "ros2 launch hsv_bringup sil.launch.py -s"))
    assert done.returncode == 0
    assert done.stdout.count("(default: ") == done.stdout.count("\n    '") == 13, done.stdout
    assert done.stdout.count("Valid choices are: ('true', 'false')") == 5, done.stdout


@pytest.fixture
def terminal(processes: Processes) -> Iterator[Terminal]:
    scenario = short_scenario(processes.folder, duration=10_000, fault=100)
    words = arguments(scenario=scenario, bag="flown", real_time_factor=4, report="false")
    opened = Terminal([*LAUNCH, *words], processes.environment, processes.folder)
    yield opened
    opened.stop()


def test_ctrl_c_paints_nothing_red_and_closes_the_bag(processes: Processes, terminal: Terminal) -> None:
    bag = processes.folder / "flown"
    terminal.wait(lambda: recorded_steps(bag) >= 50)
    terminal.interrupt()
    assert terminal.exit_code() == 0, terminal.output
    assert "ERROR" not in terminal.output and "Traceback" not in terminal.output, terminal.output
    assert terminal.output.count("process has finished cleanly") == len(graph())
    assert Bag(bag).complete


INCLUDING = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription, TimerAction
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    sil = IncludeLaunchDescription(
        [FindPackageShare("hsv_bringup"), "/launch/sil.launch.py"],
        launch_arguments={"scenario": LaunchConfiguration("flight"), "bag": "flown", "report": "false"}.items(),
    )
    return LaunchDescription([
        DeclareLaunchArgument("flight", description="what to fly"),
        ExecuteProcess(cmd=["sleep", "3600"]),  # until launch ends it
        TimerAction(period=1.0, actions=[sil]),
    ])
"""


def test_a_refusal_ends_a_launch_file_that_includes_it(processes: Processes) -> None:
    (processes.folder / "mine.launch.py").write_text(INCLUDING)
    (processes.folder / "flown").mkdir()
    # A running process makes launch end it itself, with launch's own exit code.
    refused = processes.run("ros2", "launch", "./mine.launch.py", f"flight:={short_scenario(processes.folder)}")
    assert refused.returncode == 1 and "bag = 'flown': exists already" in refused.stdout, refused.stdout


def start_to_record(processes: Processes, command: str) -> subprocess.Popen[str]:
    """Start a ros2 bag record printed in the documentation; return its process when it has subscribed."""
    log = processes.folder / "record.log"
    with log.open("w") as output:
        recorder = processes.start("bash", "-c", f"exec {command}", output=output)
    wait_until(lambda: "Recording..." in log.read_text(), [recorder.pid])
    return recorder


def finish(process: subprocess.Popen[str]) -> None:
    """End a process by Ctrl-C."""
    process.send_signal(signal.SIGINT)
    assert exit_code_of(process) == 0


@pytest.fixture(scope="module")
def recorded(shared_processes: Processes) -> tuple[Path, Path]:
    """Return two bags of Case 1, flown in real time: the bench's own, and that of ros2 bag record."""
    needs("bag", "record")  # "ros2 bag --help" succeeds without rosbag2
    bags = shared_processes.folder / "bags"
    bags.mkdir(exist_ok=True)
    recorder = start_to_record(shared_processes, the_printed(PAGE, "ros2 bag record -a"))
    launch = the_printed(PAGE, "ros2 launch hsv_bringup sil.launch.py real_time_factor:=1")
    flight = shared_processes.start("bash", "-c", f"exec {launch}")
    log, pids = shared_processes.folder / "record.log", [flight.pid, recorder.pid]
    wait_until(lambda: all(f"Subscribed to topic '/{topic}'" in log.read_text() for topic in TOPICS), pids)
    wait_until(lambda: time.time() - log.stat().st_mtime > 5.0, pids)
    assert shared_processes.run("bash", "-c", the_printed(PAGE, "hsv set paused")).returncode == 0
    assert "fingerprint  as published" in output_of(flight) and flight.returncode == 0
    finish(recorder)
    return bags / "own", bags / "recorded"


def test_a_bag_of_ros2_bag_record_gives_the_metrics_of_the_flights_own(
    shared_processes: Processes, recorded: tuple[Path, Path]
) -> None:
    ours, theirs = (told(shared_processes, "info", bag) for bag in recorded)
    assert "Messages: " in shared_processes.run("bash", "-c", the_printed(PAGE, "ros2 bag info")).stdout
    assert theirs["complete"] and not theirs["warnings"], theirs["warnings"]
    assert theirs["metrics"].keys() == ours["metrics"].keys()
    for name, value in ours["metrics"].items():
        assert theirs["metrics"][name] == pytest.approx(value, rel=1e-9, abs=1e-9), name
    assert theirs["fingerprint"] == ours["fingerprint"] and theirs["faults"] == ours["faults"]
    assert ours["as_published"] is True
    assert shared_processes.run("hsv", "diff", *recorded).stdout.rstrip().endswith("identical")


def test_a_recorded_bag_is_converted_and_indexed_anew(shared_processes: Processes, recorded: tuple[Path, Path]) -> None:
    folder, expected = shared_processes.folder, told(shared_processes, "info", recorded[1])
    options = {"uri": "bags/converted", "storage_id": "mcap", "all_topics": True, "max_bagfile_size": 300_000}
    (folder / "convert.yaml").write_text(yaml.safe_dump({"output_bags": [options]}))
    for beginning, bag in (("ros2 bag convert -i", "converted"), ("ros2 bag reindex", "recorded")):
        done = shared_processes.run("bash", "-c", the_printed(PAGE, beginning))
        assert done.returncode == 0, done.stdout
        found = told(shared_processes, "info", folder / "bags" / bag)
        assert found["metrics"] == expected["metrics"] and found["fingerprint"] == expected["fingerprint"]


def test_a_node_answers_to_a_played_bag_as_it_was_recorded(processes: Processes, recorded: tuple[Path, Path]) -> None:
    (processes.folder / "bags").mkdir()
    (processes.folder / "bags" / "own").symlink_to(recorded[0])
    log = processes.folder / "node.log"
    with log.open("w") as output:
        command = the_printed(PAGE, "ros2 run hsv_ctrl tube_mpc")
        node = processes.start("bash", "-c", f"exec {command}", output=output)
    wait_until(lambda: "waiting for" in log.read_text(), [node.pid])
    recorder = start_to_record(processes, the_printed(PAGE, "ros2 bag record -s mcap -o bags/answers"))
    done = processes.run("bash", "-c", the_printed(PAGE, "ros2 bag play"))
    assert done.returncode == 0, done.stdout
    finish(recorder)
    # In a terminal, Ctrl-C reaches all processes; ros2 run does not forward it.
    os.kill(children(node.pid)["tube_mpc"], signal.SIGINT)
    assert exit_code_of(node) == 0
    own, answers = Bag(recorded[0]), Bag(processes.folder / "bags" / "answers")
    # ros2 bag play does not wait for slow subscribers, so on a busy machine some messages are lost.
    given, expected = answers.messages("/hsv/command"), dict(own.messages("/hsv/command"))
    assert len(given) > len(expected) // 2 and all(expected[time] == data for time, data in given)


def test_faults_and_factors_come_and_go_in_flight(processes: Processes) -> None:
    launch = the_printed(PAGE, "ros2 launch hsv_bringup sil.launch.py scenario:=case2")
    flight = processes.start("bash", "-c", f"exec {launch}")
    bags = processes.folder / "bags"
    wait_until(lambda: any(recorded_steps(bag) > 50 for bag in bags.glob("*")) or flight.poll(), [flight.pid])
    for beginning, said in (
        ("ros2 service call /hsv/inject_fault", "success=True, message='loss_of_effectiveness 0.8 of elevator"),
        ("ros2 service call /hsv/clear_fault", "success=True, message='no fault of elevator_deflection from step"),
        ("ros2 param set", "Set parameter successful"),
        ("ros2 param dump", "tau: - 0.9 "),
        ("ros2 topic echo", "tau: - 0.9 "),
    ):
        for _ in range(20):  # the tools need time to discover all nodes and topics
            done = processes.run("bash", "-c", the_printed(PAGE, beginning))
            if done.returncode == 0:
                break
        assert done.returncode == 0 and said in " ".join(done.stdout.split()), done.stdout
    # ros2 doctor looks for half a second and misses some nodes. Only a real problem shows up in every report.
    alone: list[set[str]] = []
    while len(alone) < 20 and (not alone or set.intersection(*alone)):
        report = processes.run("bash", "-c", the_printed(PAGE, "ros2 doctor"))
        assert report.returncode == 0
        alone.append(set(re.findall(r"detected on (/hsv/\w+)", report.stdout)))
    assert not set.intersection(*alone), alone
    finish(flight)
    # Commands on parameters and topics leave a daemon behind, which waits for more of them.
    assert processes.run("ros2", "daemon", "stop").returncode == 0


@pytest.mark.skipif("rclcpp" not in prefixes(), reason="the installation has no rclcpp")
def test_the_controller_in_cpp_flies_as_the_one_in_python(processes: Processes) -> None:
    scenario = short_scenario(processes.folder)
    commands: list[list[np.ndarray]] = []
    for example, package in (("cpp_node", "hsv_example_cpp"), ("node", "hsv_example_node")):
        shutil.copytree(ROOT / "examples" / example, processes.folder / example)
        built = processes.run("bash", "-c", f"cd {example} && python3 -m colcon build")
        assert built.returncode == 0 and (example == "node" or "warning" not in built.stdout), built.stdout
        start = f"source {example}/install/local_setup.bash; exec {example}/install/{package}/lib/{package}/regulator"
        node = processes.start("bash", "-c", start)
        done = processes.run("hsv", "run", scenario, "--external", "--bag", f"by_{example}", "--no-report")
        assert done.returncode == 0 and node.poll() is None, done.stdout
        finish(node)
        columns = Bag(processes.folder / f"by_{example}").columns("/hsv/command")
        commands.append([columns[name] for name in ("step", "fuel_equivalence_ratio", "elevator_deflection")])
    assert len(commands[0][0]) == 251
    np.testing.assert_allclose(*commands, rtol=1e-9)


def test_two_vehicles_fly_in_one_domain_as_the_page_shows(processes: Processes) -> None:
    [example] = re.findall(r"```python\n(.*?)```", (ROOT / PAGE).read_text(encoding="utf-8"), re.DOTALL)
    (processes.folder / "two.launch.py").write_text(example)
    done = processes.run("ros2", "launch", "./two.launch.py")
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("fingerprint  as published") == 2
    for name, scenario in (("veh1", "case1"), ("veh2", "case1_derived")):
        told_of_it = told(processes, "info", processes.folder / "bags" / name)
        assert told_of_it["as_published"] is True and told_of_it["custom_data"]["scenario"] == scenario


@pytest.mark.parametrize("mode", COMPRESSED)
def test_a_compressed_bag_gives_what_the_bag_gives(processes: Processes, mode: str) -> None:
    needs("bag", "convert")
    options = {"uri": "made", "storage_id": "mcap", "all_topics": True, "compression_format": "zstd"}
    settings = {"output_bags": [options | COMPRESSED[mode]]}
    (processes.folder / "convert.yaml").write_text(yaml.safe_dump(settings))
    done = processes.run("ros2", "bag", "convert", "-i", REFERENCE, "-o", "convert.yaml")
    assert done.returncode == 0, done.stdout
    theirs, ours = told(processes, "info", "made"), told(processes, "info", REFERENCE)
    lost = ["attachments", "custom_data"]
    for name in lost:
        assert ours[name] and not theirs[name]  # convert keeps neither attachments nor metadata
    for name in ("path", "folder", *lost, "as_published", "not_covered"):
        del theirs[name], ours[name]
    assert theirs == ours
    # All forms of tables and pages are tested in tests/cli/test_rosbag2_bags.py.
    assert processes.run("hsv", "diff", "made", REFERENCE).stdout.endswith("identical\n")
