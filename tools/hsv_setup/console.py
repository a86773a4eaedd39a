"""Output for the user: one line per stage with its duration; everything else goes to a log file."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from hsv_setup.paths import LOG, ROOT

_TAIL_LINES = 30
_POLL_PERIOD = 0.2  # s
_GRACE = 3.0  # s


class SetupError(Exception):
    """Set-up cannot go on; the message says why and what to do."""


class Stage:
    """One step of the set-up: a title, its clock and its log file."""

    def __init__(self, title: str, log_name: str) -> None:
        self.title = title
        self.log = LOG / "setup" / f"{log_name}.log"
        self._start = time.monotonic()
        self._end: float | None = None
        self._live = sys.stdout.isatty()
        self.log.parent.mkdir(parents=True, exist_ok=True)
        self.log.write_text("")
        if not self._live:
            print(f"{title} ...", flush=True)

    def done(self, detail: str) -> None:
        """Print the stage's one lasting line."""
        start = "\r\x1b[K" if self._live else ""
        print(f"{start}{self.title}: {detail} ({self._elapsed:.1f} s)", flush=True)

    def _show(self, detail: str) -> None:
        print(f"\r\x1b[K{self.title} ... {detail} {self._elapsed:.0f} s", end="", flush=True)

    @property
    def _elapsed(self) -> float:
        return (self._end or time.monotonic()) - self._start

    def run(
        self,
        command: Sequence[str | Path],
        env: Mapping[str, str],
        progress: Callable[[str], str] = lambda _: "",
    ) -> None:
        """Run a command into the log; `progress` turns the log so far into the live detail.

        Raises:
            SetupError: the command failed, or one that runs beside it; names the log and quotes its end.
        """
        with self.running(command, env, progress):
            pass
        self._end = None

    @contextmanager
    def running(
        self,
        command: Sequence[str | Path],
        env: Mapping[str, str],
        progress: Callable[[str], str] = lambda _: "",
    ) -> Iterator[None]:
        """Run a command as :meth:`run` does, beside what is done in the block; its end is waited for behind it.

        Raises:
            SetupError: as there; commands that are run in the block tell it, too.
        """
        process: subprocess.Popen[bytes] | None = None
        self._end = None
        with self.log.open("ab") as out:
            out.write(("+ " + " ".join(map(str, command)) + "\n").encode())
            out.flush()
            try:
                with _interrupted_later():
                    # Its own session, so that compilers started further down end with it.
                    process = subprocess.Popen(
                        list(map(str, command)),
                        cwd=ROOT,
                        env=dict(env),
                        stdin=subprocess.DEVNULL,
                        stdout=out,
                        stderr=subprocess.STDOUT,
                        start_new_session=True,
                    )
                _running[self] = process
                yield
                while process.poll() is None:
                    for stage in _running:
                        stage._look()
                    time.sleep(_POLL_PERIOD)
                    if self._live:
                        self._show(progress(self.log.read_text(errors="replace")))
                self._look()
            except BaseException:
                if process:
                    _stop(process)
                raise
            finally:
                _running.pop(self, None)

    def _look(self) -> None:
        """Note when the command has ended.

        Raises:
            SetupError: it has failed.
        """
        code = _running[self].poll()
        if code is None:
            return
        self._end = self._end or time.monotonic()
        if code != 0:
            raise SetupError(self._failure(f"exit code {code}"))

    def _failure(self, reason: str) -> str:
        tail = self.log.read_text(errors="replace").splitlines()[-_TAIL_LINES:]
        quoted = "\n".join(f"    {line}" for line in tail)
        log = self.log.relative_to(ROOT)
        what = f"'{self.title}' failed ({reason}) after {self._elapsed:.0f} s"
        return f"{what}. The end of {log}:\n{quoted}\nFull log: {log}"


_running: dict[Stage, subprocess.Popen[bytes]] = {}
"""The commands that run, beside one another."""


@contextmanager
def _interrupted_later() -> Iterator[None]:
    """Let Ctrl-C, or being asked to end, come behind the block: what is started in it is then known."""
    came: list[tuple[int, FrameType | None]] = []
    numbers = signal.SIGINT, signal.SIGTERM
    before = {number: signal.signal(number, lambda *signalled: came.append(signalled)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        raise KeyboardInterrupt


def _stop(process: subprocess.Popen[bytes]) -> None:
    try:
        _send(process, signal.SIGINT)
    finally:  # also where Ctrl-C comes once more
        _send(process, signal.SIGKILL)


def _send(process: subprocess.Popen[bytes], number: int) -> None:
    with suppress(ProcessLookupError, subprocess.TimeoutExpired):
        os.killpg(process.pid, number)
        process.wait(timeout=_GRACE)
