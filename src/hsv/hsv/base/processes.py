"""Interruption by Ctrl-C, threads and progress of long computations."""

from __future__ import annotations

import atexit
import ctypes
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import CodeType, FrameType
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_LATER = 0.02
"""Seconds after which it is tried once more where nothing could be raised, or what was raised was swallowed."""

_PR_SET_PDEATHSIG = 1

_WHOLE: set[CodeType] = set()
"""What is not interrupted before it is finished."""


def uninterrupted(function: Callable[P, R]) -> Callable[P, R]:
    """Let an interruption of ``function``, a short one, come when it has returned.

    A process that is started is then known to who is to end it, whenever Ctrl-C comes. It takes effect where
    :func:`take_interrupts` was called. What takes longer, or starts processes that are never to receive Ctrl-C, is done
    within :func:`hsv.base.processes.ctrl_c_held_back`.
    """
    _WHOLE.add(function.__code__)
    return function


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise ``KeyboardInterrupt``, at once or as soon as the current import or uninterrupted function is finished.

    A compiled module that is interrupted fails to load with an error of its own, and a callback of the import system
    swallows the exception. A handler of signals. The timer lives on in a program in the place of this one:
    :func:`hsv.graph.launcher.become`.

    Raises:
        KeyboardInterrupt: Always, now or later.
    """
    while frame is not None:
        if frame.f_code in _WHOLE or frame.f_code.co_filename.startswith("<frozen importlib"):
            signal.setitimer(signal.ITIMER_REAL, _LATER)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def take_interrupts() -> None:
    """Let SIGINT and SIGTERM interrupt this process; it may have been started with them blocked."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, interrupt)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT,))
    sys.unraisablehook = _interrupt_again
    ignore_ctrl_c_at_end()


def ignore_ctrl_c_at_end() -> None:
    """Keep the exit code of a process that is interrupted when everything but the end of Python is done.

    Python gives signals their own effect back first, and then still takes some tens of milliseconds to let go of
    compiled libraries. The timer of an interruption that was to come later may run down in that time as well.
    """
    for number in (signal.SIGINT, signal.SIGALRM):
        atexit.register(signal.signal, number, signal.SIG_IGN)


def end_with_parent(parent: int) -> None:
    """Have Linux terminate this process, a child of ``parent``, when the thread that started it ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:  # it has ended already
            os.kill(os.getpid(), signal.SIGTERM)


def _interrupt_again(unraisable: Any) -> None:
    """Raise ``KeyboardInterrupt`` once more where a finaliser, or what a compiled library has called, swallowed it."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt) and not sys.is_finalizing():
        signal.setitimer(signal.ITIMER_REAL, _LATER)
    else:
        sys.__unraisablehook__(unraisable)


Item = TypeVar("Item")
Result = TypeVar("Result")


def over_threads(
    job: Callable[[Item], Result], items: Iterable[Item], progress: Callable[[int], None] = lambda done: None
) -> list[Result]:
    """Return ``job`` of every item, in order, from as many threads as there are processors.

    ``progress`` is called with the number of items done.
    """
    results = []
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for result in pool.map(job, items):
            results.append(result)
            progress(len(results))
    return results


@contextmanager
def ctrl_c_held_back() -> Iterator[None]:
    """Let Ctrl-C take effect at the end only; threads and processes that begin meanwhile never receive it.

    A cluster that is interrupted half started does not close. Such processes are ended by the command.
    """
    resource_tracker.ensure_running()  # where it is started, it lets Ctrl-C in
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


Progress = Callable[[str, int, int], None]
"""Function of the stage, the number of finished items, and their total number."""
