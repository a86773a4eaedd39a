"""Starting, watching and ending the processes of a graph."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hsv.errors import RunError
from hsv.graph.description import COMPOSED, PLANT, NodeDescription

GRACE = 5.0
"""Seconds between asking a process to end and forcing it."""

_FLYING = (PLANT, COMPOSED)
"""Processes that report the steps of the flight."""

_PR_SET_PDEATHSIG = 1


def executable(node: NodeDescription) -> Path:
    """Return the executable of ``node`` by the rule of ``ros2 run``.

    Raises:
        RunError: The package is not built or the workspace is not sourced.
    """
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        path = Path(prefix, "lib", node.package, node.executable)
        if prefix and os.access(path, os.X_OK):
            return path
    raise RunError(
        f"no executable {node.executable} of package {node.package}: expected a built and sourced workspace "
        "(make setup, then source env.sh)"
    )


@dataclass
class _Process:
    description: NodeDescription
    popen: subprocess.Popen[str]
    words: deque[str] = field(default_factory=lambda: deque(maxlen=10))
    reader: threading.Thread | None = None


@dataclass(frozen=True)
class Ending:
    """How a run ended: the exit code of the awaited node, or which other ended it (``culprit``), how, last words."""

    code: int | None
    culprit: str = ""
    reason: str = ""
    last_words: tuple[str, ...] = ()


class Launcher:
    """The processes of one run; a context manager that leaves no process behind."""

    def __init__(
        self,
        nodes: Sequence[NodeDescription],
        arguments: Sequence[str],
        on_step: Callable[[int], None],
        on_line: Callable[[str, str], None],
    ) -> None:
        """Prepare to start ``nodes`` with ``arguments``; report steps of the plant and other lines of any node."""
        self._nodes = list(nodes)
        self._arguments = list(arguments)
        self._on_step = on_step
        self._on_line = on_line
        self._processes: list[_Process] = []

    def __enter__(self) -> Launcher:
        paths = [executable(node) for node in self._nodes]
        try:
            for description, path in zip(self._nodes, paths, strict=True):
                self._start(description, path)
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def pids(self) -> dict[str, int]:
        """Process ids by node name."""
        return {p.description.name: p.popen.pid for p in self._processes}

    def wait(self, awaited: str = PLANT.name) -> Ending:
        """Wait for the node ``awaited`` to finish, or for any other to end before it; a plant that has landed may."""
        while True:
            for process in self._processes:
                code = process.popen.poll()
                if code is not None and not (_landed(process, code) and process.description.name != awaited):
                    return self._ending(process, code, awaited)
            time.sleep(0.02)

    def stop(self) -> None:
        """End all processes: ask, then force; the plant first, so that the recorder gets everything."""
        for number, patience in ((signal.SIGINT, GRACE), (signal.SIGTERM, GRACE / 5), (signal.SIGKILL, GRACE)):
            running = [p for p in reversed(self._processes) if p.popen.poll() is None]
            for process in running:
                process.popen.send_signal(number)
            deadline = time.monotonic() + patience
            for process in running:
                try:
                    process.popen.wait(max(0.0, deadline - time.monotonic()))
                except subprocess.TimeoutExpired:
                    continue
        for process in self._processes:
            if process.reader:
                process.reader.join(1.0)

    def _start(self, description: NodeDescription, path: Path) -> None:
        command = [str(path), "--ros-args", *self._arguments]
        if description in _FLYING:
            command += ["-p", "progress:=true"]
        popen = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            # Ctrl-C in the terminal goes to this process alone, which ends the nodes in order.
            start_new_session=True,
            preexec_fn=_die_with_parent,
        )
        process = _Process(description, popen)
        process.reader = threading.Thread(target=self._read, args=(process,), daemon=True)
        process.reader.start()
        self._processes.append(process)

    def _read(self, process: _Process) -> None:
        assert process.popen.stdout is not None
        for line in process.popen.stdout:
            text = line.rstrip()
            if process.description in _FLYING and text.startswith("step "):
                self._on_step(int(text.split()[1]))
            elif text:
                # A crashed interpreter lists its extension modules: kilobytes that tell nothing.
                if not text.startswith("Extension modules:"):
                    process.words.append(text)
                self._on_line(process.description.name, text)

    def _ending(self, process: _Process, code: int, awaited: str) -> Ending:
        if process.reader:
            process.reader.join(1.0)
        mine = process.description.name == awaited
        if mine and (code == 0 or _landed(process, code)):
            return Ending(code)
        reason = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        return Ending(code if mine else None, process.description.name, reason, tuple(process.words))


def _landed(process: _Process, code: int) -> bool:
    return process.description in _FLYING and code in (0, 3)


def _die_with_parent() -> None:
    # Where the launcher itself is killed, the nodes must not fly on without it.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
