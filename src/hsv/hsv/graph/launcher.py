"""Starting, watching and ending the processes of a graph."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NoReturn

from hsv.bags.description import (
    COMPOSED,
    LANDED,
    LIVE,
    PLANT,
    ROOT,
    NodeDescription,
    checked_namespace,
    graph,
    resolved,
)
from hsv.base.errors import ParameterError, RunError
from hsv.base.processes import ENDING, choose_log_folder, end_with_parent, uninterrupted
from hsv.graph.exclusive import claim, is_published, ros_domain
from hsv.graph.standstill import HUNG_AFTER, Standstill, processor_time

GRACE = 20.0
"""Time (s) that processes have to end after SIGINT, and a fifth of it after SIGTERM; without progress they only have
:data:`HUNG_AFTER`."""

WARNING = "[WARN] "
"""Prefix of warnings of ROS nodes and of the launcher."""

_LOOK = 0.02
"""Time (s) between two checks of the processes."""

_DOMAINS = range(41)
"""ROS domains that a run may take; the tests use others."""

_FLYING = (PLANT, COMPOSED)
"""Processes that report the steps of the flight."""


def executable(node: NodeDescription) -> Path:
    """Return the path of the executable of ``node``, found below AMENT_PREFIX_PATH as by ``ros2 run``.

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


def become(node: NodeDescription, words: Sequence[str], namespace: str = "") -> NoReturn:
    """Replace this process by the executable of ``node``, with the arguments ``words`` and in ``namespace`` if given.

    Ctrl-C and SIGTERM stay blocked until the node handles them (:func:`hsv.base.processes.take_signals`), because
    during its imports they would end it with a traceback.

    Raises:
        KeyboardInterrupt: An interrupt during an import of this process had been postponed.
        RunError: The executable was not found, see :func:`executable`.
        ParameterError: ``namespace`` is not a valid namespace.
    """
    remapped = ["--ros-args", "-r", f"__ns:={checked_namespace(namespace)}"] if namespace else []
    path = str(executable(node))
    left, _ = signal.setitimer(signal.ITIMER_REAL, 0.0)
    if left > 0.0:
        raise KeyboardInterrupt  # postponed by a timer, which would end the new program
    choose_log_folder()
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    os.execv(path, [path, *words, *remapped])


def parameter_arguments(files: Iterable[Path]) -> list[str]:
    """Return the command-line arguments by which a node loads ``files``; later files override earlier ones."""
    return [word for path in files for word in ("--params-file", str(path))]


@dataclass
class _Process:
    description: NodeDescription
    popen: subprocess.Popen[str]
    words: deque[str] = field(default_factory=lambda: deque(maxlen=10))
    reader: threading.Thread | None = None
    standstill: Standstill = field(default_factory=Standstill)
    hung: bool = False

    def idle(self) -> float:
        """Return the time (s) for which the process has used no processor time; 0 if unknown."""
        used = processor_time(self.popen.pid)
        return 0.0 if used is None else self.standstill.look(used)


class Launcher:
    """The processes of one run; a context manager that leaves no process behind."""

    def __init__(
        self,
        nodes: Sequence[NodeDescription],
        arguments: Sequence[str],
        on_step: Callable[[int], None],
        on_line: Callable[[str, str], None],
        wait_timeout: float = 10.0,
        namespace: str = ROOT,
        any_domain: bool = False,
    ) -> None:
        """Prepare to start processes.

        Args:
            nodes: Nodes to start; the run ends with the last one.
            arguments: ROS arguments of every node.
            on_step: Called with the number of every step that the plant reports.
            on_line: Called with a node's name and a text: an output line that reports no step, or a warning.
            wait_timeout: Time (s, at least HUNG_AFTER) without progress after which a process fails the run: until
                the first step any except the live view, then only the last.
            namespace: Namespace of all nodes.
            any_domain: Whether to take a free ROS domain if domain 0 is busy and ROS_DOMAIN_ID is not set; the first
                line, of no node, is then the command that sets it.
        """
        self._nodes = list(nodes)
        self._arguments = [*arguments, *(["-r", f"__ns:={namespace}"] if namespace != ROOT else [])]
        self._namespace = namespace
        self._any_domain = any_domain and not os.environ.get("ROS_DOMAIN_ID")
        self._on_step = on_step
        self._on_line = on_line
        self._wait_timeout = max(wait_timeout, HUNG_AFTER)
        self._flying = False
        self._claims = ExitStack()
        self._processes: list[_Process] = []

    def __enter__(self) -> Launcher:
        choose_log_folder()
        paths = [executable(node) for node in self._nodes]
        self._claims.enter_context(self._claim())
        try:
            for description, path in zip(self._nodes, paths, strict=True):
                self._start(description, path)
                if description is LIVE:
                    self._await_first_words(self._processes[-1])
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._claims.close()

    def wait(self) -> int:
        """Wait for the last node to finish and return its exit code: 0, or that of a flight that diverged.

        A warning is given when a process hangs, and another when it goes on. In flight the plant itself detects a
        node that does not answer, and ends.

        Raises:
            RunError: The last node failed or hung, or another node ended too early or hung before the flight began. A
                plant that has completed its flight may end first; losing the live view only gives a warning.
        """
        *others, last = self._processes
        while True:
            for process in list(others):
                code = process.popen.poll()
                if code is None or _landed(process, code):
                    continue
                reason = _ending(process, code)
                if process.description is not LIVE:
                    raise RunError(f"{process.description.label} {reason}")
                self._on_line(process.description.label, WARNING + reason)
                others.remove(process)
            for process in (*others, last):
                idle, name = process.idle(), process.description.label
                decides = process is last or not self._flying
                if idle > self._wait_timeout and decides and process.description is not LIVE:
                    raise RunError(f"{name} hangs: no progress for {idle:.1f} s, not even processor time used")
                if process.hung != (idle > HUNG_AFTER):
                    process.hung = not process.hung
                    state = f"hangs: no progress for {HUNG_AFTER:g} s" if process.hung else "goes on"
                    self._on_line(name, WARNING + state)
            code = last.popen.poll()
            if code is not None:
                if code == 0 or _landed(last, code):
                    return code
                raise RunError(f"{last.description.label} {_ending(last, code)}")
            time.sleep(_LOOK)

    def _claim(self) -> socket.socket:
        for domain in _DOMAINS if self._any_domain else ():
            with suppress(ParameterError):
                held = claim_graph(self._nodes, self._namespace)
                if domain:
                    self._on_line("", f"export ROS_DOMAIN_ID={domain}")
                return held
            os.environ["ROS_DOMAIN_ID"] = str(domain + 1)
        return claim_graph(self._nodes, self._namespace)

    def _await_first_words(self, process: _Process) -> None:
        """Wait until the viewer has reported its addresses, ended or hung; it then sees the flight from its start."""
        while not process.words and process.popen.poll() is None and process.idle() < HUNG_AFTER:
            time.sleep(_LOOK)

    def stop(self) -> None:
        """End all processes with SIGINT; send SIGTERM, then SIGKILL, to those that still run.

        They are signalled in reverse start order, in a run the plant first, so that the recorder receives everything.
        """
        for number, grace in ((signal.SIGINT, GRACE), (signal.SIGTERM, GRACE / 5), (signal.SIGKILL, GRACE)):
            running = [p for p in reversed(self._processes) if p.popen.poll() is None]
            for process in running:
                process.popen.send_signal(number)
            begun = time.monotonic()
            while time.monotonic() - begun < grace and any(
                p.popen.poll() is None and p.idle() < HUNG_AFTER for p in running
            ):
                time.sleep(_LOOK)
        for process in self._processes:
            with suppress(subprocess.TimeoutExpired):  # a killed process that waits for its disk ends later
                process.popen.wait(GRACE)
            if process.reader:
                process.reader.join(1.0)

    @uninterrupted
    def _start(self, description: NodeDescription, path: Path) -> None:
        command = [str(path), "--ros-args", *self._arguments]
        if description in _FLYING:
            command += ["-p", "progress:=true"]
        popen = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            # Warnings are recognised by the default format of the log.
            env={name: value for name, value in os.environ.items() if name != "RCUTILS_CONSOLE_OUTPUT_FORMAT"},
            text=True,
            errors="replace",
            # Ctrl-C in the terminal goes to this process alone, which ends the nodes in order.
            start_new_session=True,
            # If the launcher itself is killed, the nodes must end, too.
            preexec_fn=partial(end_with_parent, os.getpid()),
        )
        process = _Process(description, popen)
        process.reader = threading.Thread(target=self._read, args=(process,), daemon=True)
        process.reader.start()
        self._processes.append(process)

    def _read(self, process: _Process) -> None:
        assert process.popen.stdout is not None
        with process.popen.stdout as lines:
            for line in lines:
                text = line.rstrip()
                self._flying |= text.startswith("step ")
                if process.description in _FLYING and text.startswith("step "):
                    self._on_step(int(text.split()[1]))
                elif text:
                    # A crashed interpreter lists its extension modules, which explain nothing.
                    if not text.startswith("Extension modules:"):
                        process.words.append(text)
                    self._on_line(process.description.label, text)


def claim_graph(nodes: Sequence[NodeDescription], namespace: str) -> socket.socket:
    """Reserve domain and namespace for a run of ``nodes`` on this machine; return the socket that holds the claim.

    The nodes of two runs would receive each other's messages, and both runs would fail.

    Raises:
        ParameterError: Another run has this namespace in this domain, a node publishes a topic of one of ``nodes``,
            ROS_DOMAIN_ID is invalid, or nodes cannot find each other, see :func:`ros_domain`.
    """
    domain = ros_domain()
    where = f"ROS_DOMAIN_ID={domain}{f' and namespace {namespace}' if namespace != ROOT else ''}"
    held = claim("domain", domain, namespace.rstrip("/"))
    if held is None:
        raise ParameterError(f"another run has {where}: expected a separate domain or namespace for every run")
    for node in graph() if COMPOSED in nodes else nodes:
        for topic in (resolved(name, namespace) for name in node.own_topics):
            if is_published(domain, topic):
                held.close()
                raise ParameterError(
                    f"a node with {where} publishes {topic} already: expected no other {node.name} there"
                )
    return held


def _ending(process: _Process, code: int) -> str:
    """Return how a process ended: signal, or exit code and last ``[FATAL]`` line, else last non-``[INFO]`` line."""
    if process.reader:
        process.reader.join(1.0)
    if code < 0:
        return f"was killed by {signal.Signals(-code).name}"
    errors = [line for line in process.words if "[INFO]" not in line] if code < 128 else []
    # Other nodes of a composed graph can report errors after the one that ends the process.
    fatal = [line for line in errors if "[FATAL]" in line]
    return f"ended with exit code {code}" + "".join(f": {line}" for line in (fatal or errors)[-1:])


def _landed(process: _Process, code: int) -> bool:
    return process.description in _FLYING and code in LANDED
