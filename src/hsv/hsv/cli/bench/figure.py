"""A figure of the bench: two sides of the same work, measured alternately, and their ratio."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Figure:
    """A measured ratio: the times (s) of both sides, pair by pair, and the largest ratio that is promised."""

    name: str
    what: str
    against: str
    ours: tuple[float, ...]
    theirs: tuple[float, ...]
    limit: float
    note: str = ""

    @property
    def ratio(self) -> float:
        """Median of the ratios of the pairs."""
        return float(np.median(np.divide(self.ours, self.theirs)))

    @property
    def spread(self) -> tuple[float, float]:
        """10th and 90th percentile of the ratios of the pairs."""
        low, high = np.percentile(np.divide(self.ours, self.theirs), (10.0, 90.0))
        return float(low), float(high)

    @property
    def verdict(self) -> str:
        """Comparison of the ratio with the limit, in words."""
        limit = f"at most {self.limit:g}"
        return f"{limit}, as promised" if self.ratio <= self.limit else f"WORSE than the limit, {limit}"


def interleaved(
    ours: Callable[[], object],
    theirs: Callable[[], object],
    repeats: int,
    clock: Callable[[], float] = time.thread_time,
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the times (s) of both sides, measured alternately after one discarded run of each.

    The default clock is the processor time of the thread, which other programs influence little.
    """
    times: list[list[float]] = []
    for _ in range(repeats + 1):
        pair = []
        for job in (ours, theirs):
            started = clock()
            job()
            pair.append(clock() - started)
        times.append(pair)
    first, second = zip(*times[1:], strict=True)
    return first, second


def readable(seconds: float) -> str:
    """Return a time with three digits, in s, ms or us."""
    scale, unit = (1.0, "s") if seconds >= 1.0 else (1e3, "ms") if seconds >= 1e-3 else (1e6, "us")
    return f"{scale * seconds:.3g} {unit}"
