"""The checks that set-up makes of the machine."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from hsv_setup import checks, interpreter, routes
from hsv_setup.console import SetupError

SETUP = Path(__file__).parents[2] / "tools" / "setup.py"


def check(path, **variables):
    """Run the set-up's check with only the programs in `path`."""
    return subprocess.run(
        [sys.executable, SETUP, "--check"],
        env={"PATH": str(path), "PYTHON": sys.executable, **variables},
        capture_output=True,
        text=True,
    )


@pytest.fixture
def tools(tmp_path):
    """A directory with links to the machine's own build tools."""
    for name in ("gcc", "g++", "make", "cmake"):
        found = shutil.which(name)
        assert found, f"{name} is needed to run the tests"
        (tmp_path / name).symlink_to(found)
    return tmp_path


@pytest.fixture
def python():
    """This test's interpreter, as set-up sees it."""
    return interpreter.probe(sys.executable, os.environ)


def test_a_complete_machine_passes(tools):
    result = check(tools)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_everything_missing_is_named_at_once(tmp_path):
    result = check(tmp_path)
    assert result.returncode == 1
    assert result.stdout == ""
    for text in ("gcc", "g++", "cmake 3.20", "make"):
        assert f"- {text}" in result.stderr or f"({text})" in result.stderr
    assert result.stderr.rstrip().endswith("sudo apt-get install g++ make cmake")


def test_an_old_cmake_is_named_with_its_version(tools):
    (tools / "cmake").unlink()
    (tools / "cmake").write_text("#!/bin/sh\necho cmake version 3.16.3\n")
    (tools / "cmake").chmod(0o755)
    assert "cmake 3.20 or newer (found cmake version 3.16.3)" in check(tools).stderr


def test_a_python_that_does_not_start_is_named(tools):
    result = check(tools, PYTHON="/nonexistent/python3")
    assert result.returncode == 1
    assert "no working Python 3.11 or 3.12" in result.stderr


def test_another_ros_distribution_is_refused_in_one_line(tools):
    result = check(tools, ROS_DISTRO="humble")
    assert result.returncode == 1
    assert "ROS_DISTRO=humble" in result.stderr
    assert result.stderr.strip().count("\n") == 0


def test_jazzy_without_its_packages_is_refused(python):
    with pytest.raises(SetupError, match="cannot import rclpy"):
        checks.require(routes.JAZZY, replace(python, has_ros=False), os.environ)


@pytest.mark.parametrize("path", ["/srv/a b/hsv", "/srv/a:b/hsv", "/srv/a;b", "/srv/it's"])
def test_a_path_that_colcon_cannot_build_in_is_refused(path):
    assert path in checks.path_problems(path)[0].text
    assert checks.path_problems("/srv/jürgen/hsv-2.0_(1)") == []


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"version": (3, 13, 0)}, "Python 3.13.0"),
        ({"version": (3, 10, 4)}, "Python 3.10.4"),
        ({"machine": "aarch64"}, "aarch64"),
        ({"libc": ("glibc", "2.27")}, "glibc 2.28 or newer"),
        ({"libc": ("", "")}, "glibc 2.28 or newer"),
        ({"has_venv": False}, "-venv"),
        ({"has_headers": False}, "-dev"),
    ],
)
def test_each_unsuitable_interpreter_is_explained(python, change, text):
    with pytest.raises(SetupError, match=text):
        checks.require(routes.WHEELS, replace(python, **change), os.environ)


def test_set_up_does_not_depend_on_what_the_shell_has_sourced():
    root = str(SETUP.parents[1])
    sourced = {
        "PATH": f"{root}/.venv/bin:/usr/bin",
        "PYTHONPATH": f"{root}/ros_ws/build/hsv",
        "AMENT_PREFIX_PATH": f"{root}/ros_ws/install/hsv:/opt/other",
        "VIRTUAL_ENV": f"{root}/.venv",
        "MAKEFLAGS": "-j",
        "HOME": "/srv/somebody",
    }
    assert routes.clean_environment(routes.WHEELS, sourced) == {"PATH": "/usr/bin", "HOME": "/srv/somebody"}
    kept = routes.clean_environment(routes.JAZZY, sourced)
    assert kept == {"PATH": "/usr/bin", "HOME": "/srv/somebody", "AMENT_PREFIX_PATH": "/opt/other"}
