"""Detection of hung processes, as opposed to slow ones.

On a busy machine everything may take any time. Nothing in the graph is therefore given up for being late, but only for
standing still: no step, no message, no processor time used.
"""

from __future__ import annotations

import ctypes
import time

HUNG_AFTER = 5.0
"""Seconds without any progress after which a process is called hung."""

_LONGEST_GAP = 1.0
"""Largest time in seconds that counts between two looks: after a longer gap this process itself was kept waiting."""


class Standstill:
    """Time for which something has not changed."""

    def __init__(self) -> None:
        self._looked = time.monotonic()
        self._value: object = None
        self._seconds = 0.0

    def look(self, value: object) -> float:
        """Return for how long (s) the looks have found this same ``value``; look a few times a second."""
        now = time.monotonic()
        self._seconds += min(now - self._looked, _LONGEST_GAP)
        self._looked = now
        if value != self._value:
            self._value, self._seconds = value, 0.0
        return self._seconds


def processor_time(pid: int) -> float | None:
    """Return the processor time (s) that process ``pid`` has used in all threads; ``None``: not to be found out.

    To the nanosecond: a node that only waits uses some ten microseconds whenever it looks around, a stopped one none.
    """
    clock = ctypes.c_int()
    if ctypes.CDLL(None).clock_getcpuclockid(pid, ctypes.byref(clock)):
        return None
    try:
        return time.clock_gettime(clock.value)
    except OSError:
        return None
