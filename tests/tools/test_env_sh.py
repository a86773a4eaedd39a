"""env.sh in real shells, on the checkout that runs these tests."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2].resolve()
SHELLS = [
    pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"{name} is not installed"))
    for name in ("bash", "zsh")
]
pytestmark = pytest.mark.skipif(
    not (ROOT / ".venv/hsv-setup").exists(), reason="this checkout has not been set up by make setup"
)


def shell(name, script, cwd="/", **variables):
    path = "/usr/local/bin:/usr/bin:/bin"
    return subprocess.run(
        [name, "-c", script], cwd=cwd, env={"PATH": path, **variables}, capture_output=True, text=True
    )


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


@pytest.mark.parametrize("name", SHELLS)
def test_sourcing_it_again_changes_nothing(name):
    once, twice = (shell(name, f"{n * f'source {str(ROOT)!r}/env.sh; '} env | grep -v ^_= | sort") for n in (1, 2))
    assert once.stdout == twice.stdout
    assert twice.stderr == ""


@pytest.mark.parametrize("name", SHELLS)
def test_what_the_user_has_set_stays(name):
    script = f"source '{ROOT}/env.sh'; echo $ROS_AUTOMATIC_DISCOVERY_RANGE $HSV_DESIGN_PATH ${{ROS_LOG_DIR:-none}}"
    assert shell(name, script, HOME="/tmp").stdout == f"LOCALHOST {ROOT}/offline_design none\n"
    mine = shell(name, script, HOME="/tmp", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET", HSV_DESIGN_PATH="/mine")
    assert mine.stdout == "SUBNET /mine none\n"


def test_nodes_have_a_place_for_their_logs_without_a_home():
    assert shell("bash", f"source '{ROOT}/env.sh'; echo $ROS_LOG_DIR").stdout == f"{ROOT}/ros_ws/log/nodes\n"


def test_another_sourced_ros_is_refused():
    humble = {"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"}
    result = shell("bash", f"source '{ROOT}/env.sh'", **humble)
    assert result.returncode == 1
    assert "humble" in result.stderr or "Jazzy" in result.stderr


@pytest.mark.parametrize("name", SHELLS)
def test_a_distribution_that_is_named_but_not_sourced_does_not_count(name):
    script = f"source '{ROOT}/env.sh' && source '{ROOT}/env.sh' && python3 -c 'import rclpy, hsv_msgs'"
    result = shell(name, script, ROS_DISTRO="jazzy")
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize("name", SHELLS)
def test_a_checkout_that_is_not_set_up_says_so(name, tmp_path):
    shutil.copy(ROOT / "env.sh", tmp_path)
    result = shell(name, "source ./env.sh", cwd=tmp_path)
    assert result.returncode == 1
    assert "setup" in result.stderr
    assert result.stderr.count("\n") == 1


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
