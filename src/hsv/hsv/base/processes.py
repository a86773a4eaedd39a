"""Interruption by Ctrl-C, the end of processes, and threads and progress of long computations."""

from __future__ import annotations

import atexit
import ctypes
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_LATER = 0.02
"""Seconds after which an interruption that could not be raised, or was swallowed, is raised again."""

_PR_SET_PDEATHSIG = 1

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that ask a process to end; SIGHUP is sent when the terminal is closed."""

_WHOLE: set[CodeType] = set()
"""Code objects of the functions that are not interrupted."""


def uninterrupted(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a short ``function`` so that Ctrl-C takes effect only after it has returned.

    A function that starts a process, for example, can then always record it. :func:`take_interrupts` must have been
    called. Use :func:`ctrl_c_held_back` for longer work, and for processes that must not receive Ctrl-C.
    """
    _WHOLE.add(function.__code__)
    return function


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handle a signal: raise ``KeyboardInterrupt`` at once, or after the current import or uninterrupted function.

    An interrupted import of a compiled module would fail with another error, and callbacks of the import system swallow
    the exception. A timer therefore calls this function again after ``_LATER`` (s). The timer survives an ``exec``, so
    the signal is not lost even if another program is about to replace this one.

    Raises:
        KeyboardInterrupt: Unless it must be postponed.
    """
    while frame is not None:
        if frame.f_code in _WHOLE or frame.f_code.co_filename.startswith("<frozen importlib"):
            signal.setitimer(signal.ITIMER_REAL, _LATER)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def take_signals(handler: Callable[[int, FrameType | None], object]) -> None:
    """Install ``handler`` for the :data:`ENDING` signals and unblock them, so that it receives pending ones as well.

    The parent process may have blocked them while it started this one. SIGHUP stays ignored under ``nohup``.
    """
    for number in ENDING:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)


def take_interrupts() -> None:
    """Let the :data:`ENDING` signals raise ``KeyboardInterrupt``, even if the process was started with them blocked."""
    signal.signal(signal.SIGALRM, interrupt)
    take_signals(interrupt)
    sys.unraisablehook = _interrupt_again
    ignore_ctrl_c_at_end()


def ignore_ctrl_c_at_end() -> None:
    """Ignore Ctrl-C while Python shuts down, so that it does not change the exit code of the process.

    At shutdown Python restores the default effect of signals and then needs some tens of milliseconds to unload
    compiled libraries; a timer that :func:`interrupt` has set may expire in that time.
    """
    for number in (signal.SIGINT, signal.SIGALRM):
        atexit.register(signal.signal, number, signal.SIG_IGN)


def end_with_parent(parent: int) -> None:
    """On Linux, have this process terminated when the thread that started it, in process number ``parent``, ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:  # it has ended already
            os.kill(os.getpid(), signal.SIGTERM)


def choose_log_folder() -> None:
    """Have the nodes of this process and its children log to a temporary folder if the usual one cannot be written.

    Without a writable folder, the nodes would not start.
    """
    places = (("ROS_LOG_DIR",), ("ROS_HOME", "log"), ("HOME", ".ros", "log"))
    folder = next((Path(value, *rest) for name, *rest in places if (value := os.environ.get(name))), None)
    if folder:
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
    if not folder or not os.access(folder, os.W_OK):
        from tempfile import mkdtemp

        os.environ["ROS_LOG_DIR"] = mkdtemp(prefix="hsv_log_")


def _interrupt_again(unraisable: Any) -> None:
    """Raise ``KeyboardInterrupt`` again if a finaliser or a callback of a compiled library swallowed it."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt) and not sys.is_finalizing():
        signal.setitimer(signal.ITIMER_REAL, _LATER)
    else:
        sys.__unraisablehook__(unraisable)


Item = TypeVar("Item")
Result = TypeVar("Result")


def over_threads(
    job: Callable[[Item], Result], items: Iterable[Item], progress: Callable[[int], None] = lambda done: None
) -> list[Result]:
    """Return ``job(item)`` for every item, in order, computed by one thread for each processor.

    ``progress`` receives the number of finished items.
    """
    results = []
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for result in pool.map(job, items):
            results.append(result)
            progress(len(results))
    return results


@contextmanager
def ctrl_c_held_back() -> Iterator[None]:
    """Delay Ctrl-C until the end of the ``with`` block; in threads and processes started there it stays blocked.

    A pool of workers needs this because it cannot be closed if it is interrupted while it starts. After Ctrl-C,
    the code that started the pool must end its processes.
    """
    from multiprocessing import resource_tracker  # imported here: most commands start no processes

    resource_tracker.ensure_running()  # its start would unblock SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


Progress = Callable[[str, int, int], None]
"""Callback with the name of the stage, the number of finished items, and their total number."""
