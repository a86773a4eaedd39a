"""Real node processes for the graph tests: starting, finding and ending them."""

from __future__ import annotations

import signal
import subprocess
import time
from pathlib import Path
from typing import IO

SHORT = """
title = "a short Case 1"
duration = "{duration} s"

[vehicle]
coupling = "{coupling}"

[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"

[[command]]
altitude_change = "600 ft"
velocity_change = "250 ft/s"

[notch]
enabled = {notch}

[[fault]]
channel = "elevator_deflection"
type = "loss_of_effectiveness"
value = 0.9
start = "{fault} s"
"""


def short_scenario(
    folder: Path, duration: float = 5, fault: float = 3, coupling: str = "paper_like", notch: bool = True
) -> Path:
    """Write a shortened Case 1 and return its path."""
    path = folder / "short.toml"
    path.write_text(SHORT.format(duration=duration, fault=fault, coupling=coupling, notch=str(notch).lower()))
    return path


class Processes:
    """Starts processes and leaves none behind."""

    def __init__(self, environment: dict[str, str], folder: Path) -> None:
        self.environment = environment
        self.folder = folder
        self._started: list[subprocess.Popen[str]] = []

    def start(self, *command: str | Path, output: IO[str] | int = subprocess.PIPE) -> subprocess.Popen[str]:
        """Start a command with its output in a pipe, or in ``output``."""
        popen = subprocess.Popen(
            [str(word) for word in command],
            cwd=self.folder,
            env=self.environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._started.append(popen)
        return popen

    def run(self, *command: str | Path, timeout: float = 60.0) -> subprocess.CompletedProcess[str]:
        """Run a command to its end and return exit code and output."""
        popen = self.start(*command)
        output, _ = popen.communicate(timeout=timeout)
        return subprocess.CompletedProcess(popen.args, popen.returncode, output)

    def stop(self) -> None:
        """End what still runs."""
        for number, patience in ((signal.SIGINT, 5.0), (signal.SIGKILL, 5.0)):
            for popen in self._started:
                if popen.poll() is None:
                    popen.send_signal(number)
            deadline = time.monotonic() + patience
            for popen in self._started:
                try:
                    popen.wait(max(0.0, deadline - time.monotonic()))
                except subprocess.TimeoutExpired:
                    continue


def children(pid: int) -> dict[str, int]:
    """Return the node processes below ``hsv run`` with process id ``pid``, by executable name."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                words = (entry / "cmdline").read_bytes().split(b"\0")
            except (OSError, IndexError):
                continue
            if parent == pid and b"--ros-args" in words:
                executable = words[words.index(b"--ros-args") - 1].decode()
                found[Path(executable).name] = int(entry.name)
    return found
