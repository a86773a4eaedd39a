"""The package's metadata and build: dependencies, extras, version bounds, and the required compiler."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from hsv.cli.main import EXTRAS

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "hsv" / "hsv"
BY_NAME = {"clarabel"}
"""Modules that are not imported by us; cvxpy gets the solver by its name."""
DECLARED = [Requirement(line) for line in requires("hsv") or []]

OF_ROS = {"ament_index_python"}
"""Modules that are imported only if a ROS workspace is sourced."""


def extra_of(requirement):
    """Return the extra of a requirement, other than "all"; "" if it is always installed."""
    found = re.search(r'extra == "(\w+)"', str(requirement.marker or ""))
    return found[1] if found else ""


def imported():
    """Return all modules outside the standard library that the package imports, also inside functions."""
    found = set(BY_NAME)
    for path in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split(".")[0])
    return found - sys.stdlib_module_names - {"hsv"} - OF_ROS


def test_every_import_is_of_a_declared_distribution_and_every_distribution_is_used():
    by_module = packages_distributions()
    used: dict[str, set[str]] = {}
    for module in imported():
        used.setdefault(EXTRAS.get(module, ""), set()).update(map(canonicalize_name, by_module[module]))
    declared: dict[str, set[str]] = {}
    for requirement in DECLARED:
        declared.setdefault(extra_of(requirement), set()).add(canonicalize_name(requirement.name))
    everything = declared.pop("all")
    assert declared == used
    assert everything == set().union(*(names for extra, names in declared.items() if extra))


@pytest.mark.parametrize("lock", ["constraints.txt", "constraints-jazzy.txt"])
def test_bounds_have_two_sides_and_hold_the_pins(lock):
    lines = (ROOT / lock).read_text(encoding="utf-8").splitlines()
    pins = {pin.name: pin for pin in map(Requirement, (line for line in lines if not line.startswith("#")))}
    for requirement in DECLARED:
        assert sorted(bound.operator for bound in requirement.specifier) == ["<", ">="], requirement
        (pin,) = pins[canonicalize_name(requirement.name)].specifier
        assert requirement.specifier.contains(pin.version), f"{requirement}: {lock} has {pin.version}"


WITHOUT_EXTRAS = """
import sys
from importlib.abc import MetaPathFinder
from hsv.cli.entry import COMMANDS
from hsv.cli.main import EXTRAS, run

class NotInstalled(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in EXTRAS:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NotInstalled())
for words in sys.argv[1:]:
    sys.argv[1:] = words.split()
    try:
        run("hsv", COMMANDS, "")
    except SystemExit as end:
        print(words, end.code or 0, file=sys.stderr)
"""
"""A program that runs commands in turn, in a Python that cannot import any library of an extra."""


WITHOUT = {
    "simulate case1_qp": "",
    "trim": "",
    "list controllers": "",
    f"info {ROOT}/bags/reference/case1": "",
    f"replay {ROOT}/bags/reference/case2 --node plant": "",
    f"diff {ROOT}/bags/reference/case1 {ROOT}/bags/reference/case1": "",
    f"report {ROOT}/bags/reference/case1 --out page.html": "report",
    f"plot {ROOT}/bags/reference/case1 --out plot.png": "report",
    "design baseline": "design",
    "montecarlo case1 --samples 2": "campaign",
    f"export {ROOT}/bags/reference/case1 --scene": "live",
}
"""Commands with the extra that each needs; "" if none."""


@pytest.mark.long
def test_flights_and_bags_need_no_extra_and_a_missing_one_is_named(tmp_path):
    command = [sys.executable, "-c", WITHOUT_EXTRAS, *WITHOUT]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    expected = []
    for words, extra in WITHOUT.items():
        if extra:
            expected.append(f"hsv: error: needs hsv[{extra}]: pip install './src/hsv[{extra}]'")
        expected.append(f"{words} {2 if extra else 0}")
    assert ran.stderr.splitlines() == expected and ran.returncode == 0


def test_without_a_compiler_one_line_names_the_packages_to_install():
    command = [sys.executable, "setup.py", "--version"]
    ran = subprocess.run(
        command, cwd=ROOT / "src" / "hsv", env=os.environ | {"CC": "absent"}, capture_output=True, text=True
    )
    needed = "hsv needs a C compiler and Python's header files: sudo apt-get install g++ python3-dev\n"
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", needed)
