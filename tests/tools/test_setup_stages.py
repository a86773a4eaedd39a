"""Commands that set-up runs, and the paths that it rewrites."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hsv_setup import console
from hsv_setup.console import SetupError, Stage
from hsv_setup.relocate import relocate

SLOW = [sys.executable, "-u", "-c", "import os, time; print('process', os.getpid()); time.sleep(60); print('done')"]
FAILING = [sys.executable, "-c", "import sys; print('reason'); sys.exit(3)"]


def runs(stage):
    """Tell whether the process of SLOW, which its log names, runs; if it has begun at all."""
    begun = re.findall(r"^process (\d+)\n", stage.log.read_text(), re.MULTILINE)  # it is written in pieces
    return any(Path("/proc", number).exists() for number in begun)


@pytest.fixture
def stage(tmp_path, monkeypatch):
    monkeypatch.setattr(console, "ROOT", tmp_path)
    monkeypatch.setattr(console, "LOG", tmp_path / "log")
    return Stage("Trial", "trial")


def test_a_failed_command_is_quoted_with_its_log(stage):
    with pytest.raises(SetupError) as failure:
        stage.run(FAILING, env={})
    assert "'Trial' failed (exit code 3)" in str(failure.value)
    assert "    reason\n" in str(failure.value)
    assert str(failure.value).endswith("log/setup/trial.log")


def test_output_of_a_command_goes_to_the_log_only(stage, capfd):
    stage.run([sys.executable, "-c", "print('detail')"], env={})
    stage.done("well")
    assert "detail" in stage.log.read_text()
    assert capfd.readouterr().out.startswith("Trial: well (")


def test_a_command_that_fails_beside_ends_the_others_at_once(stage):
    other = Stage("Other", "other")
    with (
        pytest.raises(SetupError, match=r"'Other' failed \(exit code 3\)"),
        other.running(FAILING, env={}),
        stage.running(SLOW, env={}),
    ):
        pass
    assert not runs(stage) and "done" not in stage.log.read_text().splitlines()


def test_an_error_ends_the_command_beside(stage):
    with pytest.raises(ValueError, match="stop"), stage.running(SLOW, env={}):
        while not runs(stage):
            pass
        raise ValueError("stop")
    assert not runs(stage)


def test_ctrl_c_in_the_moment_of_a_start_leaves_nothing_behind(stage, monkeypatch):
    started = []

    class Popen(subprocess.Popen):
        def __init__(self, *arguments, **named):
            super().__init__(*arguments, **named)
            started.append(self)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Popen)
    with pytest.raises(KeyboardInterrupt):
        stage.run(SLOW, env={})
    assert [process.poll() is None for process in started] == [False]


def test_relocation_rewrites_the_builders_paths_once(tmp_path):
    builder = "/opt/python/cp311-cp311"
    cmake = tmp_path / "share/std_msgs/cmake/export.cmake"
    parent = tmp_path / "share/ament_index/resource_index/parent_prefix_path/std_msgs"
    for path in (cmake, parent):
        path.parent.mkdir(parents=True)
    numpy = f"{builder}/lib/python3.11/site-packages/numpy/_core/include"
    cmake.write_text(f'"{builder}/include/python3.11;{numpy};{builder}/lib"')
    parent.write_text(builder)
    assert relocate(tmp_path, "/usr/include/python3.11", r"/a b/num\1py") == 2
    assert cmake.read_text() == rf'"/usr/include/python3.11;/a b/num\1py;{tmp_path}/lib"'
    assert parent.read_text() == str(tmp_path)
    assert relocate(tmp_path, "/usr/include/python3.11", r"/a b/num\1py") == 0
