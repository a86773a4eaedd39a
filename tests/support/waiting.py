"""Waiting for as long as there is progress, because on a busy machine everything may take any time."""

import subprocess
import time
from contextlib import suppress

import psutil

from hsv.graph.standstill import Standstill

QUIET = 60.0
"""Seconds without progress after which a test gives up."""

_PAUSE = 0.1
_LOOK = 1.0
"""Seconds between two checks of the progress."""


def wait_until(done, pids=(), progress=lambda: None, pause=time.sleep):
    """Return when ``done`` returns a true value.

    Args:
        done: The condition to wait for.
        pids: Processes to watch with all their children: a second of processor time is progress.
        progress: Returns a value whose change is progress as well, e.g. the number of steps on disk.
        pause: Waits briefly between two checks, e.g. by spinning a node.

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


def output_of(popen):
    """Return the output of a process when it ends, however long that takes while there is progress."""
    said = ""

    def ended():
        nonlocal said
        with suppress(subprocess.TimeoutExpired):
            said, _ = popen.communicate(timeout=_LOOK)
            return True
        return False

    try:
        wait_until(ended, [popen.pid], pause=lambda _: None)
    except AssertionError as error:
        popen.kill()
        raise AssertionError(f"{error}: {popen.args}: {popen.communicate()[0]}") from None
    return said


def exit_code_of(popen):
    """Return the exit code of a process when it has ended."""
    wait_until(lambda: popen.poll() is not None, [popen.pid])
    return int(popen.returncode)


def used(pids):
    """Return the processor time (s) that these processes and all their children have used so far."""
    seconds = 0.0
    for pid in pids:
        with suppress(psutil.Error):
            process = psutil.Process(pid)
            for each in (process, *process.children(recursive=True)):
                with suppress(psutil.Error):  # the process has just ended
                    seconds += each.cpu_times().user + each.cpu_times().system
    return seconds
