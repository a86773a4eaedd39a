"""Interruption, threads and their results."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from hsv.base.processes import ENDING, choose_log_folder, take_interrupts, uninterrupted

NUMBERS = *ENDING, signal.SIGALRM

SWALLOWED = {
    "finaliser": """
class Closed:
    def __del__(self): signal.raise_signal(signal.SIGINT)
Closed()
""",
    "callback of a library": """
ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()
""",
}
"""Programs interrupted where Python only prints an exception and continues."""


@pytest.mark.parametrize("program", SWALLOWED.values(), ids=SWALLOWED)
def test_ctrl_c_is_not_lost_where_no_exception_gets_through(program) -> None:
    begin = "import ctypes, signal\nfrom hsv.base.processes import take_interrupts\ntake_interrupts()"
    # If the interrupt is lost, the loop never ends by itself; a limit of 10 s of processor time ends it.
    end = "signal.setitimer(signal.ITIMER_PROF, 10.0)\nwhile True: pass"
    ran = subprocess.run([sys.executable, "-c", f"{begin}{program}{end}"], capture_output=True, text=True)
    assert ran.returncode == -signal.SIGINT, ran.stderr
    assert ran.stderr.splitlines()[-1] == "KeyboardInterrupt" and "ignored" not in ran.stderr


@pytest.mark.parametrize("code", [0, 2])
@pytest.mark.parametrize("number", ["SIGINT", "SIGALRM"])
def test_the_exit_code_stands_when_ctrl_c_comes_at_the_very_end(code, number) -> None:
    # SIGALRM stands for an interruption that was postponed.
    program = f"""
import os, signal, sys
from hsv.base.processes import take_interrupts
take_interrupts()
class Last:
    def __del__(self, kill=os.kill, process=os.getpid(), number=signal.{number}): kill(process, number)
last = Last()
sys.exit({code})
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (code, "")


@pytest.fixture
def interrupted_as_a_command() -> Iterator[None]:
    """Handle Ctrl-C as the commands do."""
    hook, handlers = sys.unraisablehook, {number: signal.getsignal(number) for number in NUMBERS}
    take_interrupts()
    yield
    sys.unraisablehook = hook
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("interrupted_as_a_command")
def test_what_is_begun_is_finished():
    begun, finished = [], []

    @uninterrupted
    def whole() -> None:
        begun.append(1)
        signal.raise_signal(signal.SIGINT)
        finished.append(1)

    with pytest.raises(KeyboardInterrupt):
        whole()
        time.sleep(10.0)
    assert begun == finished == [1]


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({"HOME": "{}"}, True),
        ({"ROS_LOG_DIR": "{}"}, True),
        ({"HOME": "/proc"}, False),
        ({"HOME": "{}", "ROS_LOG_DIR": "/proc/log"}, False),
    ],
)
def test_nodes_log_elsewhere_if_their_folder_cannot_be_written(tmp_path, monkeypatch, given, kept) -> None:
    for name in ("ROS_LOG_DIR", "ROS_HOME", "HOME"):
        monkeypatch.setenv(name, given.get(name, "").format(tmp_path))
    before = os.environ["ROS_LOG_DIR"]
    choose_log_folder()
    assert (os.environ["ROS_LOG_DIR"] == before) is kept
    assert kept or os.access(os.environ["ROS_LOG_DIR"], os.W_OK)


def test_sighup_interrupts_unless_it_is_ignored() -> None:
    program = "import signal\n{}from hsv.base.processes import take_interrupts\ntake_interrupts()\n"
    program += "signal.raise_signal(signal.SIGHUP)\nprint('went on')"
    for ignored, out in (("", ""), ("signal.signal(signal.SIGHUP, signal.SIG_IGN)\n", "went on\n")):
        ran = subprocess.run([sys.executable, "-c", program.format(ignored)], capture_output=True, text=True)
        assert ran.stdout == out and ("KeyboardInterrupt" in ran.stderr) is (not out)
