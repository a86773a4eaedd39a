"""Requirements on the machine; everything that is missing is named at once."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass

from hsv_setup.console import SetupError
from hsv_setup.interpreter import SUPPORTED, Interpreter
from hsv_setup.paths import ROOT
from hsv_setup.routes import Route

CMAKE_AT_LEAST = (3, 20)
WHEEL_MACHINES = ("x86_64",)
WHEEL_GLIBC_AT_LEAST = (2, 28)


@dataclass(frozen=True)
class Problem:
    """Something the machine lacks, and the Debian/Ubuntu packages that bring it, if any do."""

    text: str
    packages: tuple[str, ...] = ()


def require(route: Route, python: Interpreter | None, env: Mapping[str, str]) -> None:
    """Check the machine.

    Raises:
        SetupError: something is missing; the message lists all of it and the apt-get line that brings it.
    """
    problems = path_problems(str(ROOT)) + python_problems(route, python) + tool_problems(env)
    if not problems:
        return
    lines = ["this machine cannot set the bench up yet:"]
    lines += [f"  - {problem.text}" for problem in problems]
    packages = dict.fromkeys(package for problem in problems for package in problem.packages)
    if packages:
        lines.append("On Debian 12 or Ubuntu 24.04: sudo apt-get install " + " ".join(packages))
    raise SetupError("\n".join(lines))


def path_problems(root: str) -> list[Problem]:
    """Return what is wrong with the place of the checkout."""
    # colcon's scripts, #! lines, CMake lists and search paths each have a character they cannot hold.
    if re.search(r"""[\s:;"'$\\]""", root) is None:
        return []
    return [
        Problem(f"the checkout's path has a blank or one of : ; \" ' $ \\ in it, colcon cannot build there: {root}")
    ]


def python_problems(route: Route, python: Interpreter | None) -> list[Problem]:
    """Return what is wrong with the interpreter for this route."""
    versions = " or ".join(".".join(map(str, version)) for version in SUPPORTED)
    if python is None:
        return [Problem(f"no working Python {versions} found", ("python3", "python3-venv", "python3-dev"))]
    problems = []
    if not python.supported:
        text = f"Python {python.version_text} ({python.executable}): the pinned packages are known to work with "
        # Its venv and headers are of no interest then.
        return [Problem(f"{text}{versions} only; name one with make setup PYTHON=/path/to/python3")]
    stem = _package_stem(python)
    if not python.has_venv:
        problems.append(Problem(f"Python's venv and ensurepip modules ({python.executable})", (f"{stem}-venv",)))
    if not python.has_headers:
        problems.append(Problem(f"Python's header files ({python.include}/Python.h)", (f"{stem}-dev",)))
    if route.wheels:
        problems += _wheel_problems(python)
    elif not python.has_ros:
        text = f"ROS_DISTRO=jazzy is set, but {python.executable} cannot import rclpy and colcon: source its setup.bash"
        problems.append(Problem(text, ("ros-jazzy-ros-base", "ros-dev-tools")))
    return problems


def _package_stem(python: Interpreter) -> str:
    """Return "python3" for the system's own Python, else the versioned package name."""
    system = shutil.which("python3", path="/usr/bin")
    if system is not None:
        answer = subprocess.run([system, "--version"], capture_output=True, text=True, check=False).stdout
        if not answer.startswith("Python {}.{}.".format(*python.version)):
            return "python{}.{}".format(*python.version)
    return "python3"


def _wheel_problems(python: Interpreter) -> list[Problem]:
    problems = []
    otherwise = "source a ROS 2 Jazzy installation first (Ubuntu 24.04), then make setup uses that"
    if python.machine not in WHEEL_MACHINES:
        machines = ", ".join(WHEEL_MACHINES)
        problems.append(Problem(f"ROS 2 wheels exist for {machines}, not {python.machine}: {otherwise}"))
    name, version = python.libc
    if name != "glibc" or _numbers(version) < WHEEL_GLIBC_AT_LEAST:
        needed = ".".join(map(str, WHEEL_GLIBC_AT_LEAST))
        problems.append(Problem(f"ROS 2 wheels need glibc {needed} or newer, not {name or 'this libc'} {version}"))
    return problems


def tool_problems(env: Mapping[str, str]) -> list[Problem]:
    """Return which build tools are missing or too old."""
    path = env.get("PATH")
    problems = []
    for language, variable, usual in (("C", "CC", "gcc"), ("C++", "CXX", "g++")):
        if shutil.which(env.get(variable) or usual, path=path) is None:
            problems.append(Problem(f"a {language} compiler ({env.get(variable) or usual})", ("g++",)))
    if shutil.which("make", path=path) is None:
        problems.append(Problem("make", ("make",)))
    needed = ".".join(map(str, CMAKE_AT_LEAST))
    cmake = shutil.which("cmake", path=path)
    if cmake is None:
        problems.append(Problem(f"cmake {needed} or newer", ("cmake",)))
    else:
        answer = subprocess.run([cmake, "--version"], env=dict(env), capture_output=True, text=True, check=False).stdout
        if _numbers(answer) < CMAKE_AT_LEAST:
            found = answer.splitlines()[0] if answer else "one that does not start"
            problems.append(Problem(f"cmake {needed} or newer (found {found})", ("cmake",)))
    return problems


def _numbers(text: str) -> tuple[int, ...]:
    match = re.search(r"(\d+)\.(\d+)", text)
    return tuple(map(int, match.groups())) if match else (0, 0)
