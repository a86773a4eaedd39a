"""The end of a process that leaves the graph: it comes even where the middleware does not let go."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

LEAVE_WITHIN = 10.0
"""Seconds for what takes some milliseconds; less than what ``hsv run`` gives its nodes to end."""

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


class _Times(ctypes.Structure):
    """``struct itimerspec``: seconds and nanoseconds of the period, and until the timer runs down."""

    _fields_ = (
        ("period_s", ctypes.c_long),
        ("period_ns", ctypes.c_long),
        ("first_s", ctypes.c_long),
        ("first_ns", ctypes.c_long),
    )


@contextmanager
def ends_with(code: int, within: float = LEAVE_WITHIN) -> Iterator[None]:
    """End the process with ``code`` where what stands inside takes longer than ``within`` seconds.

    For the destruction of nodes, when everything else is done. Fast DDS 2.14 can wait there for ever: a thread that
    has just received word of another participant, and the one that takes the listener away, wait for one another. That
    happens below rclpy with the interpreter locked, so that no thread or signal handler of Python can end it; a timer
    of the operating system can.

    Raises:
        OSError: The operating system refuses the timer.
    """
    library = ctypes.CDLL(None, use_errno=True)
    exit_now = ctypes.cast(library._exit, ctypes.c_void_p)
    event = _Event(value=code, notification=_NEW_THREAD, function=exit_now.value)
    times = _Times(first_s=int(within), first_ns=int(within % 1 * 1e9))
    timer = ctypes.c_void_p()
    _check(library.timer_create(_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)))
    try:
        _check(library.timer_settime(timer, 0, ctypes.byref(times), None))
        yield
    finally:
        _check(library.timer_delete(timer))


def _check(result: int) -> None:
    if result:
        raise OSError(ctypes.get_errno(), "timer of the operating system")
