"""The end of a process that leaves the graph: it comes even where the middleware does not let go."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

LEAVE_WITHIN = 3.0
"""Seconds for what takes some milliseconds; less than the standstill after which ``hsv run`` says that a node hangs."""

_MONOTONIC = 1
_NEW_THREAD = 2
"""``CLOCK_MONOTONIC`` and ``SIGEV_THREAD`` of Linux."""


class _Event(ctypes.Structure):
    """``struct sigevent``: what happens when a timer has run down."""

    _fields_ = (
        ("value", ctypes.c_long),
        ("signal", ctypes.c_int),
        ("notification", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("reserved", ctypes.c_byte * 32),
    )


@contextmanager
def ends_with(code: int, within: float = LEAVE_WITHIN) -> Iterator[None]:
    """End the process with exit code ``code`` if the body takes longer than ``within`` seconds.

    For the destruction of nodes, when everything else is done and written. Fast DDS 2.14 can wait there for ever: a
    thread that has just received word of another participant, and the one that removes the listener, wait for each
    other. That happens below rclpy with the interpreter locked, so that no thread or signal handler of Python can end
    it; a timer of the operating system can. Where the system refuses the timer, the body runs without it.
    """
    library = ctypes.CDLL(None)
    exit_now = ctypes.cast(library._exit, ctypes.c_void_p)
    event = _Event(value=code, notification=_NEW_THREAD, function=exit_now.value)
    timer = ctypes.c_void_p()
    if library.timer_create(_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)):
        yield
        return
    # struct itimerspec: the period, which is none, and the time until it runs down, in seconds and nanoseconds.
    times = (ctypes.c_long * 4)(0, 0, int(within), int(within % 1 * 1e9))
    library.timer_settime(timer, 0, times, None)
    try:
        yield
    finally:
        library.timer_delete(timer)
