"""A Dask cluster over SSH: the scheduler runs here, and workers that are lost are started again.

A worker that loses its scheduler, as when its host is cut off, ends; Dask leaves it to others to start a new one.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from hsv.base.errors import CampaignError, DocumentError, RunError
from hsv.base.files import read_text
from hsv.base.processes import uninterrupted

AGAIN_AFTER = 5.0
"""Seconds after which the workers of a host are started again."""

_LOOK = 0.2

_ALIVE = ("BatchMode=yes", "ServerAliveInterval=5", "ServerAliveCountMax=3", "ConnectTimeout=15")
"""Options of ssh: nobody is there to be asked, and a host that is cut off is noticed after 15 s."""

_SCHEDULER = ("-m", "distributed.cli.dask_scheduler", "--no-dashboard", "--no-show")
_WORKER = "-m distributed.cli.dask_worker --nthreads 1 --no-dashboard --death-timeout 60"

Say = Callable[[str], None]


class Host(NamedTuple):
    """A host as ssh knows it, and the number of its workers; 0: one per processor."""

    name: str
    workers: int


def read_host(text: str) -> Host:
    """Return the host in ``text``, such as ``me@worker-1`` or, with 8 workers, ``worker-1*8``.

    Raises:
        CampaignError: It is none.
    """
    found = re.fullmatch(r"([^\s*-][^\s*]*)(?:\*([1-9]\d{0,3}))?", text.strip())
    if not found:
        raise CampaignError(f"host = {text.strip()!r}: expected NAME or NAME*WORKERS, as in worker-1*8")
    return Host(found[1], int(found[2] or 0))


def read_hosts(path: Path) -> list[Host]:
    """Return the hosts in a file, one a line; what follows a # is a comment.

    Raises:
        CampaignError: The file cannot be read, or a line of it is no host.
    """
    try:
        lines = read_text(path).splitlines()
    except DocumentError as error:
        raise CampaignError(f"hosts = {str(path)!r}: {error}, expected a list of hosts") from error
    hosts = []
    for number, line in enumerate(lines, start=1):
        if text := line.partition("#")[0].strip():
            try:
                hosts.append(read_host(text))
            except CampaignError as error:
                raise CampaignError(f"{path}, line {number}: {error}") from error
    return hosts


def address_for(host: str) -> str:
    """Return the address of this machine on the way to ``host``.

    Raises:
        CampaignError: There is no way.
    """
    name = host.rpartition("@")[2]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect((name, 22))  # sends nothing
        except OSError as error:
            raise CampaignError(
                f"host = {host!r}: no way there ({error.strerror}); expected --address, where hosts reach this machine"
            ) from error
        return str(way.getsockname()[0])


def remote_python() -> str:
    """Return what runs our Python on a host that has the project where this one has it, to be read by bash."""
    root = os.environ.get("HSV_ROOT")
    source = f"source {shlex.quote(str(Path(root, 'env.sh')))} && " if root else ""
    return f"{source}exec {shlex.quote(sys.executable)}"


def read_ssh(text: str) -> list[str]:
    """Return the words of the command ssh, with options, as a shell splits them.

    Raises:
        CampaignError: There are none, or this machine has no such command.
    """
    expected = f"ssh = {text!r}: expected a command of this machine, with options, as in 'ssh -p 2222'"
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise CampaignError(f"{expected} ({str(error).lower()})") from error
    if not words or shutil.which(words[0]) is None:
        raise CampaignError(expected)
    return words


class _Process:
    """A process whose last words are kept."""

    def __init__(self, words: Sequence[str]) -> None:
        self._output = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115 - closed by stop
        self._popen = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=self._output, stderr=subprocess.STDOUT)

    @property
    def ended(self) -> str:
        """Why it has ended; empty while it runs."""
        code = self._popen.poll()
        if code is None:
            return ""
        self._output.seek(0)
        said = [line.strip() for line in self._output.read().splitlines() if line.strip()]
        return said[-1] if said else f"ended with exit code {code}"

    def stop(self) -> None:
        """End it, and take no more than some seconds."""
        self._popen.terminate()
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(AGAIN_AFTER)
        self._popen.kill()
        self._popen.wait()
        self._output.close()


class _Workers:
    """The workers of a host: an SSH connection that is made again when it ends."""

    def __init__(self, host: Host, words: Sequence[str], say: Say) -> None:
        self._host, self._words, self._say = host, words, say
        self._process: _Process | None = None
        self._due = time.monotonic()
        self._said = ""

    def look(self) -> None:
        """Start the workers if they are due, and say how they ended if they have."""
        now = time.monotonic()
        if self._process is None:
            if now >= self._due:
                self._start()
        elif why := self._process.ended:
            if why != self._said:
                self._say(f"{self._host.name}: no workers ({why}), trying again every {AGAIN_AFTER:g} s")
            self.stop()
            self._said, self._due = why, now + AGAIN_AFTER

    @uninterrupted
    def _start(self) -> None:
        self._process = _Process(self._words)

    def stop(self) -> None:
        """End the connection, and with it the workers."""
        if self._process:
            self._process.stop()
            self._process = None


@contextmanager
def cluster(
    hosts: Iterable[Host], address: str, port: int, python: str, ssh: str, say: Say = lambda words: None
) -> Iterator[Callable[[], None]]:
    """Start scheduler and workers; yield what keeps them running, to be called again and again.

    Args:
        hosts: Where workers are.
        address: Of this machine, as the hosts know it.
        port: Of the scheduler.
        python: What runs Python on a host, see :func:`remote_python`.
        ssh: The command ssh, with options of the user's.
        say: Takes what happens to a host, in words.

    Raises:
        CampaignError: The scheduler does not start, or ``ssh`` is no command.
        RunError: From what is yielded: the scheduler has ended.
    """
    command = read_ssh(ssh)
    goal = f"tcp://{address}:{port}"
    with ExitStack() as stack:

        @uninterrupted
        def start(words: Sequence[str]) -> _Process:
            process = _Process(words)
            stack.callback(process.stop)
            return process

        if _answers(address, port):
            raise CampaignError(f"port = {port}: in use, expected a free port of this machine")
        scheduler = start([sys.executable, *_SCHEDULER, "--host", address, "--port", str(port)])
        while not _answers(address, port):
            if why := scheduler.ended:
                raise CampaignError(f"scheduler {goal}: does not start ({why}), expected an address of this machine")
            time.sleep(_LOOK)
        workers = []
        for host in hosts:
            count = f"--nworkers {host.workers or 'auto'}"
            there = f"export DASK_LOGGING__DISTRIBUTED=error; {python} {_WORKER} {count} {goal}"
            # With a terminal the workers end when the connection does.
            options = [word for option in _ALIVE for word in ("-o", option)]
            words = [*command, "-tt", *options, host.name, f"bash -c {shlex.quote(there)}"]
            workers.append(_Workers(host, words, say))
            stack.callback(workers[-1].stop)

        def look() -> None:
            if scheduler.ended:
                raise RunError(f"scheduler {goal}: ended ({scheduler.ended})")
            for each in workers:
                each.look()
            time.sleep(_LOOK)

        yield look


def _answers(address: str, port: int) -> bool:
    with suppress(OSError), socket.create_connection((address, port), timeout=1.0):
        return True
    return False
