"""Tools of a sourced full ROS 2 installation: ros2 launch, bag, service, param and doctor."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from waiting import wait_until

from ros2 import real_command

COMMANDS = ("launch", "service", "param", "doctor")
"""The subcommands of ros2 that all tests need."""


@cache
def missing(*words: str) -> str:
    """Return why tests of ``ros2`` with ``words`` cannot run here; empty if they can."""
    command = real_command()
    if command is None:
        return "no full ROS 2 installation is sourced: there is no ros2 but that of .venv"
    asked = subprocess.run([command, *words, "--help"], capture_output=True, check=False)
    return f"the installation that is sourced has no ros2 {' '.join(words)}" if asked.returncode else ""


def needs(*words: str) -> None:
    """Skip the test if ``ros2`` with ``words`` is missing."""
    if reason := missing(*words):
        pytest.skip(reason)


class Terminal:
    """A command in its own terminal, where Ctrl-C reaches all its processes at once, as for a user."""

    def __init__(self, command: list[str], environment: dict[str, str], folder: Path) -> None:
        self.pid, self._terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, environment)
        self.output = ""
        self.code: int | None = None

    def wait(self, done: Callable[[], object]) -> None:
        """Wait until ``done`` returns a true value or the command has ended."""
        wait_until(lambda: done() or self.code is not None, [self.pid], pause=self._read)

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        os.write(self._terminal, b"\x03")

    def exit_code(self) -> int:
        """Wait for the command to end and return its exit code."""
        self.wait(lambda: False)
        assert self.code is not None
        return self.code

    def stop(self) -> None:
        """Kill the processes that still run."""
        if self.code is None:
            os.killpg(self.pid, signal.SIGKILL)
            self.exit_code()
        os.close(self._terminal)

    def _read(self, seconds: float) -> None:
        if select.select([self._terminal], [], [], seconds)[0]:
            try:
                self.output += os.read(self._terminal, 65536).decode(errors="replace")
            except OSError:  # no process has the other end open any more
                self.code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
