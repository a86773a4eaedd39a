"""Every command that the README and the pages on commands, graph and installations print is run, somewhere."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from node_processes import Processes, recorded_steps
from printed_commands import ROOT, printed
from ros_domain import own_environment
from waiting import exit_code_of, wait_until

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

FULL = {
    "ros2 launch hsv_bringup sil.launch.py scenario:=case1",
    "ros2 launch hsv_bringup sil.launch.py -s",
    "ros2 launch hsv_bringup sil.launch.py scenario:=case2 real_time_factor:=1",
    "ros2 service call /hsv/inject_fault hsv_msgs/srv/InjectFault "
    '"{fault: {channel: elevator_deflection, type: loss_of_effectiveness, parameter_names: [effectiveness], '
    'parameter_values: [0.8]}}"',
    'ros2 service call /hsv/clear_fault hsv_msgs/srv/ClearFault "{channel: elevator_deflection}"',
    'ros2 param set /tube_mpc feedback.tau "[0.9]"',
    "ros2 param dump /tube_mpc",
    "ros2 topic echo --once /hsv/tube_status",
    "ros2 doctor --report-failed",
    "ros2 bag record -a -s mcap -o bags/recorded",
    "ros2 launch hsv_bringup sil.launch.py real_time_factor:=1 bag:=bags/own",
    "ros2 bag info bags/recorded",
    "ros2 bag convert -i bags/recorded -o convert.yaml",
    "ros2 bag reindex bags/recorded -s mcap",
    "ros2 run hsv_ctrl tube_mpc --ros-args -p recorder:=false",
    "ros2 bag record -s mcap -o bags/answers --topics /hsv/command /hsv/tube_status",
    "ros2 bag play bags/own --topics /hsv/run /hsv/filtered_state /hsv/nominal --rate 5 --delay 3",
}
"""Run by tests/graph/test_full_installation.py, or the same with another bag."""

ELSEWHERE = {
    "sudo apt-get install git g++ make cmake python3 python3-venv python3-dev": "on a new machine",
    "sudo apt-get install g++ python3-dev python3-venv": "on a new machine",
    "make run": "make",
    "make test": "make",
    "source env.sh": "tests/tools/test_env_sh.py",
    "source /opt/ros/jazzy/setup.bash": "of the installation",
    "fastdds shm clean": "of ROS 2",
    "ros2 run hsv_ctrl notch_filter --ros-args -r __ns:=/veh1 -r __node:=nf2": "tests/graph/test_names.py",
    "ros2 run hsv_ctrl tube_mpc --ros-args -r hsv/command:=wish": "tests/graph/test_names.py",
    "hsv run case2 --real-time-factor 1": "the flight of IN_FLIGHT",
    "hsv watch": "tests/graph/test_watch.py",
    "hsv-paper figures --only 9": "tests/hsv_paper/test_figures.py",
    "hsv-paper sensitivity coupling": "tests/hsv_paper/test_sensitivity.py",
    "hsv-paper claims": "tests/hsv_paper/test_claims.py",
    "hsv run case1 --live": "tests/graph/test_live.py",
    "hsv topic /hsv/state --every 50": "tests/graph/test_by_hand.py",
    "cd examples/node": "tests/graph/test_own_controllers.py",
    "python3 -m colcon build": "tests/graph/test_own_controllers.py",
    "source install/local_setup.bash": "test_a_workspace_of_ones_own, tests/graph/test_own_controllers.py",
    "hsv run regulator.toml": "tests/graph/test_own_controllers.py",
    "hsv run case1 --external": "tests/graph/test_own_controllers.py",
    "mkdir -p my_ws/src": "test_a_workspace_of_ones_own",
    "cd my_ws": "test_a_workspace_of_ones_own",
    "python3 -m colcon build --symlink-install": "test_a_workspace_of_ones_own",
    "python3 -m colcon": "a form",
}
"""Where what cannot be run as printed by a test is tried, in some form."""

DIFFERENT = {"hsv diff bags/first bags/second": 1}
"""Exit codes other than 0."""


def test_every_printed_command_is_run_and_every_command_that_is_run_is_printed() -> None:
    tables = (HERE, TOGETHER, IN_FLIGHT, FULL, {*ELSEWHERE})
    assert {command for page in PAGES for command in printed(page)} == set().union(*tables)
    assert sum(map(len, tables)) == len(set().union(*tables))


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
    [flight] = [command for command, where in ELSEWHERE.items() if "IN_FLIGHT" in where]
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        popen = processes.start("bash", "-c", f"exec {flight} --bag bags/answering --no-report")
        wait_until(lambda: recorded_steps(checkout / "bags" / "answering") > 50, [popen.pid])
        for command in [command for page in PAGES for command in printed(page) if command in IN_FLIGHT]:
            done = processes.run("bash", "-c", command)
            assert done.returncode == 0, f"{command}: {done.stdout}"
        assert popen.poll() is None
        processes.stop()


@pytest.mark.long
def test_a_workspace_of_ones_own(tmp_path: Path) -> None:
    """An overlay of a package of the bench takes its place, as the page says."""
    source = ROOT / "ros_ws" / "src" / "hsv_ctrl"
    lines = [command for command in printed("docs/installation.md") if ELSEWHERE.get(command, "").startswith("test_a_")]
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
