"""Detection of hung processes, as opposed to slow ones.

On a busy machine, everything may take any time. A process is therefore not given up because it is late, but only if it
makes no progress: no step, no message, no processor time used.
"""

from __future__ import annotations

import ctypes
import time

HUNG_AFTER = 5.0
"""Time (s) without any progress after which a process counts as hung."""

_C_LIBRARY = ctypes.CDLL(None)

_LONGEST_GAP = 1.0
"""Maximum time (s) that counts between two looks; after a longer gap, this process itself had to wait."""


class Standstill:
    """Measurement of the time for which a value has not changed."""

    def __init__(self) -> None:
        self._looked = time.monotonic()
        self._value: object = None
        self._seconds = 0.0

    def look(self, value: object) -> float:
        """Return the time (s) since ``value`` last changed; a gap between two calls counts as at most 1 s."""
        now = time.monotonic()
        self._seconds += min(now - self._looked, _LONGEST_GAP)
        self._looked = now
        if value != self._value:
            self._value, self._seconds = value, 0.0
        return self._seconds


def processor_time(pid: int) -> float | None:
    """Return the processor time (s) that process ``pid`` has used in all threads; None if it cannot be determined.

    The resolution of 1 ns tells a node that only waits, which uses about 10 µs at each wake-up, from a stopped one.
    """
    clock = ctypes.c_int()
    if _C_LIBRARY.clock_getcpuclockid(pid, ctypes.byref(clock)):
        return None
    try:
        return time.clock_gettime(clock.value)
    except OSError:
        return None
