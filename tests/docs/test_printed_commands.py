"""The commands that the README and the pages on commands, graph and installations print are run as they stand."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from node_processes import Processes, recorded_steps
from page_blocks import PAGES as EVERY_PAGE
from printed_commands import ROOT, printed
from ros_domain import own_environment
from typer.main import get_command
from waiting import exit_code_of, wait_until

from hsv.cli.entry import COMMANDS
from hsv.cli.main import application

PAGES = ("README.md", "docs/graph.md", "docs/scenarios.md", "docs/reference/commands.md", "docs/installation.md")

HERE = {
    "hsv run case1 --bag bags/case1_readme",
    "hsv plot bags/case1_readme --units paper --out docs/images/case1.png",
    "hsv list scenarios",
    "hsv list faults",
    "hsv list equipment",
    "hsv run case1 --bag bags/first",
    "hsv run case1_derived --bag bags/second",
    "hsv simulate case1",
    "hsv info bags/first bags/second",
    "hsv report bags/case1* --out all.html",
    "hsv plot bags/first",
    "hsv report bags/first bags/second --out bags/second/comparison.html",
    'hsv trim --altitude "85500 ft" --velocity "7900 ft/s" --units paper',
    "hsv linearise --coupling derived",
    "hsv design baseline",
    "hsv verify offline_design/baseline.yaml",
    "hsv export-controller baseline --out controller",
    "hsv run case1 --composed",
    "hsv montecarlo case1 --samples 100 --seed 1",
    "hsv resilience --controllers case1 --faults elevator_loss",
    "hsv run case1 --namespace /veh1",
    "hsv replay bags/first",
    "hsv replay bags/first --rerun",
    "hsv play bags/first --rate 50",
    "hsv diff bags/first bags/second",
    "hsv export bags/first --csv",
    "hsv export bags/first --scene",
    "hsv recover bags/first",
    "hsv run case1 --bag bags/case1",
    "hsv montecarlo case1 --corners",
    "ROS_DOMAIN_ID=7 hsv run case1",
    "hsv prepare case1 --json",
}
"""Run by this file as one script, in a folder like the checkout, in the order in which they are printed."""

TOGETHER = {
    "ros2 run hsv_bringup recorder",
    "ros2 run hsv_ctrl notch_filter",
    "ros2 run hsv_ctrl nominal_trajectory",
    "ros2 run hsv_ctrl tube_mpc",
    "ros2 run hsv_plant fault_injector --ros-args -p fault.channels:=[elevator_deflection] "
    "-p fault.types:=[loss_of_effectiveness] -p fault.parameters:=[effectiveness=0.9] -p fault.starts:=[100.0]",
    "ros2 run hsv_plant plant --ros-args -p duration:=200.0",
}
"""Run by this file at the same time."""

IN_FLIGHT = {
    "hsv fault inject elevator_deflection loss_of_effectiveness 0.8",
    "hsv fault list",
    "hsv fault clear elevator_deflection",
    'hsv command "86050 ft" "8140 ft/s"',
    "hsv set tau 0.9",
    "hsv topic",
}
"""Run by this file on the flight that is printed before them."""

DIFFERENT = {"hsv diff bags/first bags/second": 1}
"""Exit codes other than 0."""


def test_every_printed_command_of_hsv_exists_with_the_options_that_it_is_printed_with() -> None:
    program = get_command(application(COMMANDS))
    for line in {line for page in EVERY_PAGE for line in printed(page) if line.startswith("hsv ")}:
        command, (_, *words) = program, line.split()
        while words and words[0] in getattr(command, "commands", {}):
            command = command.commands[words.pop(0)]
        # Where no subcommand is named, one of them is meant.
        meant = [command, *getattr(command, "commands", {}).values()]
        known = {option for each in meant for parameter in each.params for option in parameter.opts}
        assert command is not program, line
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= known | {"--help"}, line


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Return a folder with what the commands read of the checkout, and room for what they write."""
    for name in ("offline_design", "src"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "docs" / "images").mkdir(parents=True)
    return tmp_path


@pytest.mark.long
def test_commands_run_as_they_are_printed(checkout: Path) -> None:
    commands = list(dict.fromkeys(command for page in PAGES for command in printed(page) if command in HERE))
    assert len(commands) == len(HERE)
    # Not everything below bags is a bag: the reference bags have a folder, and so have the flights of studies.
    (checkout / "bags").mkdir()
    (checkout / "bags" / "reference").symlink_to(ROOT / "bags" / "reference")
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        script = "\n".join(
            f"{command} || [ $? = {DIFFERENT[command]} ]" if command in DIFFERENT else command for command in commands
        )
        done = processes.run("bash", "-e", "-x", "-c", script)
        assert done.returncode == 0, done.stdout
        processes.stop()


@pytest.mark.long
def test_the_nodes_fly_in_terminals_of_their_own(checkout: Path) -> None:
    commands = [command for command in printed("README.md") if command in TOGETHER]
    assert len(commands) == len(TOGETHER)
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        started = {command: processes.start("bash", "-c", f"exec {command}") for command in commands}
        plant = next(popen for command, popen in started.items() if " plant " in command)
        assert exit_code_of(plant) == 0
        [bag] = (checkout / "bags").iterdir()
        wait_until(lambda: recorded_steps(bag) == 10_001, [popen.pid for popen in started.values()])
        for popen in started.values():
            if popen is not plant:
                popen.send_signal(signal.SIGINT)
                assert exit_code_of(popen) == 0
        assert (bag / "metadata.yaml").is_file()


@pytest.mark.long
def test_a_flight_answers_as_it_is_printed(checkout: Path) -> None:
    commands = [command for page in PAGES for command in printed(page) if command in IN_FLIGHT]
    assert len(commands) == len(IN_FLIGHT)
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        popen = processes.start(
            "bash", "-c", "exec hsv run case2 --real-time-factor 1 --bag bags/answering --no-report"
        )
        wait_until(lambda: recorded_steps(checkout / "bags" / "answering") > 50, [popen.pid])
        for command in commands:
            done = processes.run("bash", "-c", command)
            assert done.returncode == 0, f"{command}: {done.stdout}"
        assert popen.poll() is None
        processes.stop()


@pytest.mark.long
def test_a_workspace_of_ones_own(tmp_path: Path) -> None:
    """An overlay of a package of the bench takes its place, as the page says."""
    source = ROOT / "ros_ws" / "src" / "hsv_ctrl"
    lines = [
        "mkdir -p my_ws/src",
        "cd my_ws",
        "python3 -m colcon build --symlink-install",
        "source install/local_setup.bash",
    ]
    assert {*lines} <= {*printed("docs/installation.md")}
    script = [
        *lines[:2],
        f"cp -r {source} src",
        *lines[2:],
        "ros2 pkg prefix hsv_ctrl",
    ]
    environment = os.environ | {"MAKEFLAGS": "-j1"}
    command = ["bash", "-e", "-c", "\n".join(script)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == str(tmp_path / "my_ws" / "install" / "hsv_ctrl")
    assert (tmp_path / "my_ws" / "install" / "hsv_ctrl" / "lib" / "hsv_ctrl" / "tube_mpc").is_file()
