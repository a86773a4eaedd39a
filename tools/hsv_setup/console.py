"""Output for the user: one line per stage with its duration; everything else goes to a log file."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from hsv_setup.paths import LOG, ROOT

_TAIL_LINES = 30
_POLL_PERIOD = 0.2  # s


class SetupError(Exception):
    """Set-up cannot go on; the message says why and what to do."""


class Stage:
    """One step of the set-up: a title, its clock and its log file."""

    def __init__(self, title: str, log_name: str) -> None:
        self.title = title
        self.log = LOG / "setup" / f"{log_name}.log"
        self._start = time.monotonic()
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
        return time.monotonic() - self._start

    def run(
        self,
        command: Sequence[str | Path],
        env: Mapping[str, str],
        progress: Callable[[str], str] = lambda _: "",
    ) -> None:
        """Run a command into the log; `progress` turns the log so far into the live detail.

        Raises:
            SetupError: the command failed; names the log and quotes its end.
        """
        with self.running(command, env, progress):
            pass

    @contextmanager
    def running(
        self,
        command: Sequence[str | Path],
        env: Mapping[str, str],
        progress: Callable[[str], str] = lambda _: "",
    ) -> Iterator[None]:
        """Run a command as :meth:`run` does, beside what is done in the block; its end is waited for behind it.

        Raises:
            SetupError: the command failed; names the log and quotes its end.
        """
        with self.log.open("ab") as out:
            out.write(("+ " + " ".join(map(str, command)) + "\n").encode())
            out.flush()
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
            try:
                yield
                while process.poll() is None:
                    time.sleep(_POLL_PERIOD)
                    if self._live:
                        self._show(progress(self.log.read_text(errors="replace")))
            except BaseException:
                _stop(process)
                raise
        if process.returncode != 0:
            raise SetupError(self._failure(f"exit code {process.returncode}"))

    def _failure(self, reason: str) -> str:
        tail = self.log.read_text(errors="replace").splitlines()[-_TAIL_LINES:]
        quoted = "\n".join(f"    {line}" for line in tail)
        log = self.log.relative_to(ROOT)
        what = f"'{self.title}' failed ({reason}) after {self._elapsed:.0f} s"
        return f"{what}. The end of {log}:\n{quoted}\nFull log: {log}"


def _stop(process: subprocess.Popen[bytes]) -> None:
    for number, wait_timeout in ((signal.SIGINT, 3.0), (signal.SIGKILL, 3.0)):
        try:
            os.killpg(process.pid, number)
            process.wait(timeout=wait_timeout)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            continue
