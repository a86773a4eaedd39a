"""Waiting as long as there is progress: on a busy machine everything may take any time, and still it goes on."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from hsv.graph.standstill import Standstill, processor_time

QUIET = 60.0
"""Seconds without progress after which a test gives up."""

_PAUSE = 0.1
_LOOK = 1.0
"""Seconds between two looks at the progress: all processes of the machine are looked through."""


def wait_until(
    done: Callable[[], object],
    pids: Iterable[int] = (),
    progress: Callable[[], object] = lambda: None,
    pause: Callable[[float], object] = time.sleep,
) -> None:
    """Return when ``done`` returns something true.

    Args:
        done: What is waited for.
        pids: Processes that are watched with all that they start: a second of processor time is progress.
        progress: Returns what else must not stand still, e.g. steps on the disk.
        pause: Waits a little between two looks, e.g. by spinning a node.

    Raises:
        AssertionError: No progress for :data:`QUIET` seconds.
    """
    watched = tuple(pids)
    standstill, looks = Standstill(), 0.0
    while not done():
        if time.monotonic() >= looks:
            looks = time.monotonic() + _LOOK
            seconds = standstill.look((progress(), int(used(watched))))
            assert seconds < QUIET, f"no progress for {seconds:.0f} s"
        pause(_PAUSE)


def output_of(popen: subprocess.Popen[str]) -> str:
    """Return what a process writes until it ends; while there is progress it may take its time."""
    said = ""

    def ended() -> bool:
        nonlocal said
        try:
            said, _ = popen.communicate(timeout=_LOOK)
        except subprocess.TimeoutExpired:
            return False
        return True

    try:
        wait_until(ended, [popen.pid], pause=lambda _: None)
    except AssertionError as error:
        popen.kill()
        raise AssertionError(f"{error}: {popen.args}: {popen.communicate()[0]}") from None
    return said


def exit_code_of(popen: subprocess.Popen[str]) -> int:
    """Return the exit code of a process once it has ended."""
    wait_until(lambda: popen.poll() is not None, [popen.pid])
    return int(popen.returncode)


def used(pids: Iterable[int]) -> float:
    """Return the processor time (s) that these processes and all that they have started have used so far."""
    below: dict[int, list[int]] = {}
    for pid, parent in parents().items():
        below.setdefault(parent, []).append(pid)
    family, to_come = set[int](), list(pids)
    while to_come:
        pid = to_come.pop()
        family.add(pid)
        to_come += below.get(pid, [])
    return sum(processor_time(pid) or 0.0 for pid in family)


def parents() -> dict[int, int]:
    """Return the parent of every process on this machine."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                found[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError):
                continue  # it has just ended
    return found
