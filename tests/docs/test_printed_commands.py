"""The commands printed in the README and on the pages on commands, graph and installation run as printed."""

import signal

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

IN_FLIGHT = {
    "hsv fault inject elevator_deflection loss_of_effectiveness 0.8",
    "hsv fault list",
    "hsv fault clear elevator_deflection",
    'hsv command "86050 ft" "8140 ft/s"',
    "hsv set tau 0.9",
    "hsv set paused false",
    "hsv topic",
}
"""Commands that run on the flight printed before them."""

OTHERS = {
    "hsv run case1 --live",
    "hsv run case1 --external",
    "hsv run case2 --real-time-factor 1",
    "hsv run regulator.toml",
    "hsv topic /hsv/state --every 50",
    "hsv watch",
}
"""Commands that are not run: they wait for a browser or a node, or do not end. tests/graph runs similar ones."""

ELSEWHERE = {
    "hsv run case1 --namespace /veh1",
    "hsv simulate mine.toml",
    "hsv verify offline_design/baseline.yaml",
    "hsv design baseline",
    "hsv montecarlo case1 --corners",
    "hsv resilience --controllers case1 --faults elevator_loss",
}
"""Long commands, and one on a file of the reader's. Others like them run in tests/graph/test_names.py,
tests/flight/test_flown_checks.py, tests/design/test_agreement.py, tests/docs/test_blocks.py and
tests/cli/test_resilience.py."""

SAME = {f"hsv run case1 --bag bags/{name}": f"cp -r bags/case1_readme bags/{name}" for name in ("first", "case1")}
"""Flights that have already been flown under another name are copied."""

DIFFERENT = {"hsv diff bags/first bags/second": 1}
"""Expected exit codes other than 0."""


def test_every_printed_command_of_hsv_exists_with_the_options_that_it_is_printed_with():
    program = get_command(application(COMMANDS))
    for line in {line for page in EVERY_PAGE for line in printed(page) if line.startswith("hsv ")}:
        command, (_, *words) = program, line.split()
        while words and words[0] in getattr(command, "commands", {}):
            command = command.commands[words.pop(0)]
        # A command without a named subcommand may have the options of any of them.
        meant = [command, *getattr(command, "commands", {}).values()]
        known = {option for each in meant for parameter in each.params for option in parameter.opts}
        assert command is not program, line
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= known | {"--help"}, line


@pytest.fixture
def checkout(tmp_path):
    """Return a folder with the files of the checkout that commands read, and space for their output."""
    for name in ("offline_design", "src"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "docs" / "images").mkdir(parents=True)
    return tmp_path


@pytest.mark.long
def test_commands_run_as_they_are_printed(checkout):
    every = dict.fromkeys(command for page in PAGES for command in printed(page) if "hsv " in command)
    commands = [each for each in every if each.startswith("hsv ") and each not in OTHERS | IN_FLIGHT | ELSEWHERE]
    assert len(commands) > 25 and {*every} >= OTHERS | ELSEWHERE | {*SAME}
    # The reference bags and the flights of studies have their own folders below bags.
    (checkout / "bags").mkdir()
    (checkout / "bags" / "reference").symlink_to(ROOT / "bags" / "reference")
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        script = "\n".join(SAME.get(each, f"{each} || [ $? = {DIFFERENT.get(each, 0)} ]") for each in commands)
        done = processes.run("bash", "-e", "-x", "-c", script)
        assert done.returncode == 0, done.stdout
        processes.stop()


@pytest.mark.long
def test_the_nodes_fly_in_terminals_of_their_own(checkout):
    commands = [command for command in printed("README.md") if command.startswith("ros2 run ")]
    assert len(commands) == 6
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
def test_a_flight_answers_as_it_is_printed(checkout):
    commands = list(dict.fromkeys(command for page in PAGES for command in printed(page) if command in IN_FLIGHT))
    assert len(commands) == len(IN_FLIGHT)
    with own_environment() as environment:
        processes = Processes(environment, checkout)
        flight = "hsv run case2 --real-time-factor 1 --bag bags/answering --no-report"
        popen = processes.start("bash", "-c", f"exec {flight}")
        wait_until(lambda: recorded_steps(checkout / "bags" / "answering") > 50, [popen.pid])
        for command in commands:
            done = processes.run("bash", "-c", command)
            assert done.returncode == 0, f"{command}: {done.stdout}"
        assert popen.poll() is None
        processes.stop()
