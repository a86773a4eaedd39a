"""How long the steps of a node take."""

from __future__ import annotations

import time

import numpy as np


class StepTimes:
    """Collects the wall time of a block per step; as text it is their 99th percentile, in ms."""

    def __init__(self) -> None:
        self._seconds: list[float] = []

    def __enter__(self) -> None:
        self._started = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds.append(time.perf_counter() - self._started)

    def __str__(self) -> str:
        return f"{1e3 * np.percentile(self._seconds, 99):.3f}"
