"""The set-up: its requirements on the machine, when it must act; and env.sh in real shells."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import setup

ROOT = Path(__file__).parents[2].resolve()


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return a checkout with one package of each kind, which the set-up takes for its own."""
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


SHELLS = [
    pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"{name} is not installed"))
    for name in ("bash", "zsh")
]
is_set_up = pytest.mark.skipif(
    not (ROOT / ".venv/hsv-setup").exists(), reason="this checkout has not been set up by make setup"
)


def shell(name, script, cwd="/", **variables):
    path = "/usr/local/bin:/usr/bin:/bin"
    return subprocess.run(
        [name, "-c", script], cwd=cwd, env={"PATH": path, **variables}, capture_output=True, text=True
    )


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_it_activates_the_workspace_from_any_directory(name):
    result = shell(
        name, f"set -eu; source '{ROOT}/env.sh'; command -v python3 hsv ros2; echo $HSV_ROOT $HSV_DESIGN_PATH"
    )
    assert (result.returncode, result.stderr) == (0, "")
    python, hsv, ros2, directories = result.stdout.splitlines()
    assert python == f"{ROOT}/.venv/bin/python3"
    assert hsv.startswith(f"{ROOT}/ros_ws/install/")
    assert ros2 == f"{ROOT}/.venv/bin/ros2"
    assert directories == f"{ROOT} {ROOT}/offline_design"


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_sourcing_it_again_changes_nothing(name):
    once, twice = (shell(name, f"{n * f'source {str(ROOT)!r}/env.sh; '} env | grep -v ^_= | sort") for n in (1, 2))
    assert once.stdout == twice.stdout
    assert twice.stderr == ""


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_what_the_user_has_set_stays(name):
    script = f"source '{ROOT}/env.sh'; echo $ROS_AUTOMATIC_DISCOVERY_RANGE $HSV_DESIGN_PATH ${{ROS_LOG_DIR:-none}}"
    assert shell(name, script, HOME="/tmp").stdout == f"LOCALHOST {ROOT}/offline_design none\n"
    mine = shell(name, script, HOME="/tmp", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET", HSV_DESIGN_PATH="/mine")
    assert mine.stdout == "SUBNET /mine none\n"
    # Without a home directory, nodes write their logs to a folder of the checkout.
    assert shell(name, f"source '{ROOT}/env.sh'; echo $ROS_LOG_DIR", HOME="").stdout == f"{ROOT}/ros_ws/log/nodes\n"


@is_set_up
def test_another_sourced_ros_is_refused():
    humble = {"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"}
    result = shell("bash", f"source '{ROOT}/env.sh'", **humble)
    assert result.returncode == 1
    assert "humble" in result.stderr or "Jazzy" in result.stderr


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_a_distribution_that_is_named_but_not_sourced_does_not_count(name):
    script = f"source '{ROOT}/env.sh' && source '{ROOT}/env.sh' && python3 -c 'import rclpy, hsv_msgs'"
    result = shell(name, script, ROS_DISTRO="jazzy")
    assert (result.returncode, result.stderr) == (0, "")


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_a_checkout_that_is_not_set_up_says_so(name, tmp_path):
    shutil.copy(ROOT / "env.sh", tmp_path)
    result = shell(name, "source ./env.sh", cwd=tmp_path)
    assert result.returncode == 1
    assert "setup" in result.stderr
    assert result.stderr.count("\n") == 1


@is_set_up
@pytest.mark.parametrize("name", SHELLS)
def test_an_interactive_shell_completes_the_words_of_the_command(name):
    asked = "complete -p hsv" if name == "bash" else "echo $_comps[hsv]"
    flags = ["--norc"] if name == "bash" else ["-f"]
    result = subprocess.run(
        [name, *flags, "-i", "-c", f"source '{ROOT}/env.sh'; {asked}"],
        env={"PATH": "/usr/local/bin:/usr/bin:/bin"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert "_hsv_completion" in result.stdout
