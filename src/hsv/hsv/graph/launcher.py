"""Starting, watching and ending the processes of a graph."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hsv.errors import RunError
from hsv.graph.description import COMPOSED, EXIT_DIVERGED, PLANT, NodeDescription

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


def parameter_arguments(files: Iterable[Path]) -> list[str]:
    """Return the arguments with which a node takes its parameters from ``files``, later ones over earlier ones."""
    return [word for path in files for word in ("--params-file", str(path))]


@dataclass
class _Process:
    description: NodeDescription
    popen: subprocess.Popen[str]
    words: deque[str] = field(default_factory=lambda: deque(maxlen=10))
    reader: threading.Thread | None = None


class Launcher:
    """The processes of one run; a context manager that leaves no process behind."""

    def __init__(
        self,
        nodes: Sequence[NodeDescription],
        arguments: Sequence[str],
        on_step: Callable[[int], None],
        on_line: Callable[[str, str], None],
    ) -> None:
        """Prepare to start ``nodes`` with ``arguments``, the one that ends the run last; report steps, other lines."""
        self._nodes = list(nodes)
        self._arguments = list(arguments)
        self._on_step = on_step
        self._on_line = on_line
        self._processes: list[_Process] = []

    def __enter__(self) -> Launcher:
        paths = [executable(node) for node in self._nodes]
        self._domain = _domain_of_its_own()
        try:
            for description, path in zip(self._nodes, paths, strict=True):
                self._start(description, path)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._domain.close()

    def wait(self) -> int:
        """Wait for the last node to finish and return its exit code: 0, or that of a flight that diverged.

        Raises:
            RunError: It failed, or another ended before it (a plant that has landed may); with its last words.
        """
        *others, last = self._processes
        while True:
            for process in others:
                code = process.popen.poll()
                if code is not None and not _landed(process, code):
                    raise self._failure(process, code)
            code = last.popen.poll()
            if code is not None:
                if code == 0 or _landed(last, code):
                    return code
                raise self._failure(last, code)
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

    def _failure(self, process: _Process, code: int) -> RunError:
        if process.reader:
            process.reader.join(1.0)
        reason = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        words = "".join(f"\n  {word}" for word in process.words)
        return RunError(f"{process.description.name} {reason}{'. Its last words:' if words else ''}{words}")


def _landed(process: _Process, code: int) -> bool:
    return process.description in _FLYING and code in (0, EXIT_DIVERGED)


def _domain_of_its_own() -> socket.socket:
    """Return what keeps the ROS domain to this run, on this machine, for as long as it is open.

    The nodes of two runs would take each other's messages, and both would be lost.
    """
    number = os.environ.get("ROS_DOMAIN_ID") or "0"
    name = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        # A name without a file: it is gone with this process, however that ends.
        name.bind(f"\0hsv_domain_{number}")
    except OSError:
        name.close()
        raise RunError(f"another run has ROS_DOMAIN_ID={number}: expected a domain of its own for every run") from None
    return name


def _die_with_parent() -> None:
    # Where the launcher itself is killed, the nodes must not fly on without it.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
