"""Detection of hung processes, as opposed to slow ones.

On a busy machine, everything may take any time. A process is therefore not given up because it is late, but only if it
makes no progress: no step, no message, no processor time used.
"""

from __future__ import annotations

import ctypes
import time

HUNG_AFTER = 5.0
"""Time (s) without any progress after which a process counts as hung."""

_LONGEST_GAP = 1.0
"""Maximum time (s) that counts between two looks; after a longer gap, this process itself had to wait."""


class Standstill:
    """Measurement of the time for which a value has not changed."""

    def __init__(self) -> None:
        self._looked = time.monotonic()
        self._value: object = None
        self._seconds = 0.0

    def look(self, value: object) -> float:
        """Return the time (s) for which ``value`` was the same in successive calls; call this a few times a second."""
        now = time.monotonic()
        self._seconds += min(now - self._looked, _LONGEST_GAP)
        self._looked = now
        if value != self._value:
            self._value, self._seconds = value, 0.0
        return self._seconds


def processor_time(pid: int) -> float | None:
    """Return the processor time (s) that process ``pid`` has used in all threads; None if it cannot be determined.

    The resolution is 1 ns: a node that only waits uses about 10 µs each time that it wakes up, a stopped node none.
    """
    clock = ctypes.c_int()
    if ctypes.CDLL(None).clock_getcpuclockid(pid, ctypes.byref(clock)):
        return None
    try:
        return time.clock_gettime(clock.value)
    except OSError:
        return None
