"""Waiting as long as there is progress: on a busy machine everything may take any time, and still it goes on."""

import subprocess
import time
from contextlib import suppress

import psutil

from hsv.graph.standstill import Standstill

QUIET = 60.0
"""Seconds without progress after which a test gives up."""

_PAUSE = 0.1
_LOOK = 1.0
"""Seconds between two looks at the progress."""


def wait_until(done, pids=(), progress=lambda: None, pause=time.sleep):
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


def output_of(popen):
    """Return what a process writes until it ends; while there is progress it may take its time."""
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
    """Return the exit code of a process once it has ended."""
    wait_until(lambda: popen.poll() is not None, [popen.pid])
    return int(popen.returncode)


def used(pids):
    """Return the processor time (s) that these processes and all that they have started have used so far."""
    seconds = 0.0
    for pid in pids:
        with suppress(psutil.Error):
            process = psutil.Process(pid)
            for each in (process, *process.children(recursive=True)):
                with suppress(psutil.Error):  # it has just ended
                    seconds += each.cpu_times().user + each.cpu_times().system
    return seconds
