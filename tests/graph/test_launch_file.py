"""Checks of the launch file that do not need launch; test_full_installation.py runs it."""

import ast
import inspect
import sys
from pathlib import Path

from hsv.cli.fly import prepare, run

FILE = Path(__file__).parents[2] / "ros_ws" / "src" / "hsv_bringup" / "launch" / "sil.launch.py"
TREE = ast.parse(FILE.read_text(encoding="utf-8"))
INSTALLED = {"launch", "launch_ros", "ament_index_python"}
"""Packages in every ROS 2 installation that has launch."""


def arguments():
    """Return the names of the launch arguments."""
    [table] = [node.value for node in TREE.body if isinstance(node, ast.Assign) and node.targets[0].id == "ARGUMENTS"]
    return set(ast.literal_eval(table))


def test_it_imports_nothing_that_an_installation_without_the_bench_lacks():
    imported = set()
    for node in ast.walk(TREE):
        if isinstance(node, ast.Import):
            imported |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(str(node.module).split(".")[0])
    assert imported >= INSTALLED
    assert imported - INSTALLED <= sys.stdlib_module_names


def test_it_has_an_argument_for_every_option_of_hsv_run():
    # A launch argument cannot be repeated as --set can; a scenario file makes the same changes.
    of_the_terminal = {"every", "json", "strict", "verbose", "changes"}
    options = set(inspect.signature(run).parameters) - of_the_terminal
    assert arguments() >= options
    assert set(inspect.signature(prepare).parameters) - {"folder", "json", "changes"} <= options
    assert arguments() - options == {"log_level"}
