"""The replacement of the ros2 command, with a small installation made by the test."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROS2 = Path(__file__).parents[2] / "tools" / "ros2.py"


@pytest.fixture
def prefix(tmp_path):
    """Return an installation prefix with the packages alpha (two executables) and beta (none)."""
    root = tmp_path / "install"
    index = root / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    for name in ("alpha", "beta"):
        (index / name).touch()
    executable(root / "lib/alpha/talk", '#!/bin/sh\necho "pid $$" "$@"\nexit 7\n')
    executable(root / "lib/alpha/wait", "#!/bin/sh\necho $$\nexec sleep 60\n")
    (root / "lib/alpha/notes.txt").write_text("not executable")
    executable(root / "lib/alpha/.hidden/secret", "#!/bin/sh\n")
    return root


def executable(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


def command_line(*arguments):
    return [sys.executable, "-S", str(ROS2), *map(str, arguments)]


def environment(prefix, path="/usr/bin:/bin"):
    return {"AMENT_PREFIX_PATH": f"/nonexistent:{prefix}", "PATH": path}


def ros2(prefix, *arguments, **options):
    return subprocess.run(command_line(*arguments), env=environment(prefix, **options), capture_output=True, text=True)


def test_run_passes_arguments_and_exit_code(prefix):
    result = ros2(prefix, "run", "alpha", "talk", "--ros-args", "-p", "a:=1 2")
    assert result.returncode == 7
    assert result.stdout.split(maxsplit=2)[2] == "--ros-args -p a:=1 2\n"


def test_run_is_replaced_by_the_executable(prefix):
    process = subprocess.Popen(
        command_line("run", "alpha", "wait"), env=environment(prefix), stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == f"{process.pid}\n"
    process.send_signal(signal.SIGINT)
    assert process.wait() == -signal.SIGINT
    process.stdout.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "gamma", "talk"), "Package 'gamma' not found"),
        (("run", "alpha", "sing"), "No executable found"),
        (("run", "alpha", "notes.txt"), "No executable found"),
        (("run", "alpha", "secret"), "No executable found"),
        (("pkg", "executables", "gamma"), "Package 'gamma' not found"),
        (("pkg", "prefix", "gamma"), "Package not found"),
    ],
)
def test_what_is_not_there_is_named_as_the_real_tool_does(prefix, arguments, message):
    result = ros2(prefix, *arguments)
    assert (result.returncode, result.stderr, result.stdout) == (1, message + "\n", "")


def test_run_refuses_an_ambiguous_name(prefix):
    executable(prefix / "lib/alpha/more/talk", "#!/bin/sh\n")
    result = ros2(prefix, "run", "alpha", "talk")
    assert result.returncode == 1
    assert result.stderr.startswith("Multiple executables found:\n- ")


def test_pkg_lists(prefix):
    assert ros2(prefix, "pkg", "list").stdout == "alpha\nbeta\n"
    assert ros2(prefix, "pkg", "executables").stdout == "alpha talk\nalpha wait\n"
    assert ros2(prefix, "pkg", "executables", "beta").stdout == ""
    assert ros2(prefix, "pkg", "prefix", "beta").stdout == f"{prefix}\n"
    assert ros2(prefix, "pkg", "prefix", "--share", "beta").stdout == f"{prefix}/share/beta\n"


def test_the_first_prefix_on_the_path_wins(prefix, tmp_path):
    overlay = tmp_path / "overlay"
    marker = overlay / "share/ament_index/resource_index/packages/alpha"
    marker.parent.mkdir(parents=True)
    marker.touch()
    assert ros2(f"{overlay}:{prefix}", "pkg", "prefix", "alpha").stdout == f"{overlay}\n"


@pytest.mark.parametrize("arguments", [("topic", "list"), ("launch", "a", "b"), ("pkg", "create", "x"), ("bag",)])
def test_other_commands_need_the_full_tools(prefix, arguments):
    result = ros2(prefix, *arguments)
    assert result.returncode == 2
    assert "full ROS 2 command-line tools" in result.stderr
    assert result.stderr.count("\n") == 1


def test_it_steps_aside_for_a_real_ros2_but_not_for_its_own_kind(prefix, tmp_path):
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    executable(ours / "ros2", f'#!/bin/sh\nexec {sys.executable} -S {ROS2} "$@"\n')
    executable(theirs / "ros2", '#!/bin/sh\necho real "$@"\nexit 3\n')
    alone = ros2(prefix, "pkg", "list", path=f"{ours}:/usr/bin:/bin")
    assert alone.stdout == "alpha\nbeta\n"
    both = ros2(prefix, "topic", "list", path=os.pathsep.join([str(ours), str(theirs), "/usr/bin", "/bin"]))
    assert (both.returncode, both.stdout) == (3, "real topic list\n")
