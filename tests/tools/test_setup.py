"""The set-up: what it asks of the machine, what it takes from the shell, and when it has something to do."""

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


def test_everything_missing_is_named_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(setup, "ROOT", Path("/srv/a ü"))
    monkeypatch.setattr(setup.platform, "machine", lambda: "aarch64")
    found = setup.missing("wheels", {"PATH": str(tmp_path)})
    for text in (
        "a path of ASCII letters, without blanks",
        "this is aarch64",
        "a compiler (gcc)",
        "cmake 3.20 or newer",
    ):
        assert any(text in name for name in found), text
    assert {*found.values()} == {"", "g++", "cmake"}


def test_another_ros_distribution_is_refused_in_one_line():
    command = [sys.executable, ROOT / "tools" / "setup.py"]
    sourced = {"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"}
    ran = subprocess.run(command, env={**os.environ, **sourced}, capture_output=True, text=True)
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr.startswith("make setup: ROS_DISTRO=humble is sourced") and ran.stderr.count("\n") == 1


def test_a_failed_command_is_one_line_that_names_its_log(here):
    code = "import sys; print('begun'); print('reason', file=sys.stderr); sys.exit(3)"
    with pytest.raises(setup.SetupError, match=r"^Trial of it failed: reason \(more in log/setup-trial.log\)$"):
        setup.Step("Trial of it", [sys.executable, "-u", "-c", code], dict(os.environ)).end()
    assert (here / "log" / "setup-trial.log").read_text() == "begun\nreason\n"


@pytest.mark.parametrize(
    ("name", "matters"),
    [
        ("flyer/setup.py", True),
        ("flyer/flyer/core/core.h", True),
        ("flyer/launch/new.launch.py", True),
        ("flyer/flyer/__init__.py", False),
        ("flyer/flyer/table.toml", False),
        ("msgs/New.msg", True),
    ],
)
def test_a_package_is_built_again_only_if_that_changes_it(here, name, matters):
    package, path = here / name.partition("/")[0], here / name
    before = setup.package_key(package, "identity", "numpy==2.4.1\n")
    path.parent.mkdir(exist_ok=True)
    path.write_text("2\n")
    assert (setup.package_key(package, "identity", "numpy==2.4.1\n") != before) == matters


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
