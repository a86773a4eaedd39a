"""Statistics of the durations of a node's steps."""

from __future__ import annotations

import time
from collections import deque

import numpy as np

WINDOW = 1000
"""Steps looked back on: their percentile is taken in flight, once a simulated second."""


class StepTimes:
    """Collects the wall time of a block per step; as text it is the 99th percentile of the last steps, in ms."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=WINDOW)

    def __enter__(self) -> None:
        self._started = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds.append(time.perf_counter() - self._started)

    def __str__(self) -> str:
        return f"{1e3 * np.percentile(self._seconds, 99):.3f}"
