"""The set-up: what it asks of the machine, what it takes from the shell, and when it has something to do."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import setup

ROOT = Path(__file__).parents[2]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A checkout with a package of each kind, and its logs."""
    monkeypatch.setattr(setup, "ROOT", tmp_path)
    monkeypatch.setattr(setup, "LOG", tmp_path / "log")
    for name in ("setup.py", "package.xml", "flyer/__init__.py", "flyer/table.toml", "flyer/core/core.h"):
        path = tmp_path / "flyer" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1\n")
    (tmp_path / "msgs").mkdir()
    (tmp_path / "msgs" / "State.msg").write_text("float64 x\n")
    return tmp_path


def test_a_complete_machine_lacks_nothing():
    assert setup.missing("wheels", dict(os.environ)) == {}


def test_everything_missing_is_named_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(setup, "ROOT", Path("/srv/a ü"))
    monkeypatch.setattr(setup.platform, "machine", lambda: "aarch64")
    found = setup.missing("wheels", {"PATH": str(tmp_path)})
    for text in (
        "a path of ASCII letters, without blanks",
        "for colcon and CMake (/srv/a ü)",
        "this is aarch64",
        "a compiler (gcc)",
        "a compiler (g++)",
        "cmake 3.20 or newer",
    ):
        assert any(text in name for name in found), text
    assert {*found.values()} == {"", "g++", "cmake"}


def test_an_old_cmake_is_missing(tmp_path):
    (tmp_path / "cmake").write_text("#!/bin/sh\necho cmake version 3.16.3\n")
    (tmp_path / "cmake").chmod(0o755)
    path = f"{tmp_path}:{os.environ['PATH']}"
    assert setup.missing("wheels", {**os.environ, "PATH": path}) == {"cmake 3.20 or newer": "cmake"}


def test_another_ros_distribution_is_refused_in_one_line():
    command = [sys.executable, ROOT / "tools" / "setup.py"]
    sourced = {"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"}
    ran = subprocess.run(command, env={**os.environ, **sourced}, capture_output=True, text=True)
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr.startswith("make setup: ROS_DISTRO=humble is sourced") and ran.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("prefixes", "route"), [("", "wheels"), (f"{ROOT}/.venv", "wheels"), (f"{ROOT}/.venv:/opt/ros/jazzy", "jazzy")]
)
def test_a_distribution_counts_where_it_is_sourced(monkeypatch, prefixes, route):
    monkeypatch.setattr(os, "environ", {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": prefixes})
    assert setup.sourced_distribution() == route


def test_the_set_up_does_not_depend_on_what_the_shell_has_sourced(monkeypatch):
    sourced = {
        "PATH": f"{ROOT}/.venv/bin:/usr/bin",
        "PYTHONPATH": f"{ROOT}/ros_ws/build/hsv",
        "AMENT_PREFIX_PATH": f"{ROOT}/ros_ws/install/hsv:/opt/other",
        "VIRTUAL_ENV": f"{ROOT}/.venv",
        "HOME": "/srv/somebody",
    }
    monkeypatch.setattr(os, "environ", sourced)
    assert setup.clean_environment("wheels") == {"PATH": "/usr/bin", "HOME": "/srv/somebody"}
    assert setup.clean_environment("jazzy")["AMENT_PREFIX_PATH"] == "/opt/other"


def test_a_failed_command_is_one_line_that_names_its_log(here):
    code = "import sys; print('begun'); print('reason', file=sys.stderr); sys.exit(3)"
    with pytest.raises(setup.SetupError, match=r"^Trial of it failed: reason \(more in log/setup-trial.log\)$"):
        setup.Step("Trial of it", [sys.executable, "-u", "-c", code], dict(os.environ)).end()
    assert (here / "log" / "setup-trial.log").read_text() == "begun\nreason\n"


@pytest.mark.parametrize(
    ("package", "name", "matters"),
    [
        ("flyer", "setup.py", True),
        ("flyer", "flyer/core/core.h", True),
        ("flyer", "launch/new.launch.py", True),
        ("flyer", "flyer/__init__.py", False),
        ("flyer", "flyer/table.toml", False),
        ("flyer", "flyer.egg-info/PKG-INFO", False),
        ("msgs", "State.msg", True),
        ("msgs", "New.msg", True),
    ],
)
def test_a_package_is_built_again_only_if_that_changes_it(here, package, name, matters):
    before = setup.package_key(here / package, "identity", "numpy==2.4.1\n")
    path = here / package / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("2\n")
    assert (setup.package_key(here / package, "identity", "numpy==2.4.1\n") != before) == matters


def test_messages_are_built_again_for_another_numpy_and_a_python_package_for_another_interpreter(here):
    keys = {
        setup.package_key(here / "msgs", identity, pins)
        for identity in ("one", "other")
        for pins in ("numpy==1\n", "numpy==2\n")
    }
    assert len(keys) == 4
    assert setup.package_key(here / "flyer", "one", "") != setup.package_key(here / "flyer", "other", "")


def test_paths_of_the_wheels_builder_become_those_of_the_environment(tmp_path, monkeypatch):
    monkeypatch.setattr(setup, "VENV", tmp_path)
    cmake = tmp_path / "share" / "some_msgs" / "cmake" / "export.cmake"
    prefix = tmp_path / "share" / "ament_index" / "resource_index" / "parent_prefix_path" / "some_msgs"
    for path in (cmake, prefix):
        path.parent.mkdir(parents=True)
    builder = "/opt/python/cp311-cp311"
    cmake.write_text(f"{builder}/include/python3.11;{builder}/lib/python3.11/site-packages/numpy/_core/include\n")
    prefix.write_text(builder)
    for _ in range(2):
        setup.relocate()
    include = setup.sysconfig.get_path("include")
    assert cmake.read_text() == f"{include};{tmp_path}/lib/python3.11/site-packages/numpy/_core/include\n"
    assert prefix.read_text() == str(tmp_path)
