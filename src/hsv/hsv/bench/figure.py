"""A figure of the bench: two sides measured in turn, their ratio, and what it is held against."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Figure:
    """A measured figure and what it is compared with, in ``unit``; without a comparison, ``theirs`` is empty."""

    name: str
    what: str
    against: str
    unit: str
    ours: tuple[float, ...]
    theirs: tuple[float, ...] = ()
    bound: str = ""
    """``"most"`` or ``"least"``: which side of the limit is good, where ``"least"`` is for what is better if larger;
    without a limit nothing is promised."""
    limit: float | None = None
    goal: float | None = None
    note: str = ""

    @property
    def ratios(self) -> np.ndarray:
        """Ours over theirs, pair by pair; ours alone where there is no other side."""
        return np.array(self.ours) / np.array(self.theirs) if self.theirs else np.array(self.ours)

    @property
    def median(self) -> float:
        """Median of the ratios."""
        return float(np.median(self.ratios))

    @property
    def percentiles(self) -> tuple[float, float]:
        """10th and 90th percentile of the ratios."""
        low, high = np.percentile(self.ratios, (10.0, 90.0))
        return float(low), float(high)

    @property
    def is_rate(self) -> bool:
        """Whether more is better."""
        return self.bound == "least"

    @property
    def verdict(self) -> str:
        """Comparison of the median with limit and goal, in words; empty if nothing is promised."""
        if self.limit is None:
            return ""
        sign = -1.0 if self.is_rate else 1.0
        limit = self._written(self.limit)
        if sign * self.median > sign * self.limit:
            return f"WORSE than the limit, {limit}"
        if self.goal is None:
            return f"{limit}, as promised"
        goal = self._written(self.goal)
        if sign * self.median > sign * self.goal:
            return f"{limit}, as promised; short of the goal, {goal}"
        return f"{goal}, which is the goal"

    def _written(self, value: float) -> str:
        return f"at {self.bound} {value:g}{'' if self.theirs else f' {self.unit}'}"


def interleaved(
    ours: Callable[[], object],
    theirs: Callable[[], object],
    repeats: int,
    clock: Callable[[], float] = time.thread_time,
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the times (s) of both sides, measured in turn after one run of each that is not counted.

    The processor time of the thread by default: what other programs take does not count.
    """
    times: tuple[list[float], list[float]] = [], []
    for job in (ours, theirs):
        job()
    for _ in range(repeats):
        for job, taken in zip((ours, theirs), times, strict=True):
            started = clock()
            job()
            taken.append(clock() - started)
    return tuple(times[0]), tuple(times[1])
