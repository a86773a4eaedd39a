"""A figure of the bench: two sides of the same work, measured alternately, their ratio, and its change since a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hsv.base.errors import DocumentError, QuantityError
from hsv.base.files import parse_json, read_text

RESOLUTION = 0.05
"""Largest relative change that the same commit shows from run to run on an idle machine."""


class Recorded(NamedTuple):
    """A figure of a recorded run: its group, ratio, and the 10th and 90th percentile of the ratios."""

    group: str
    ratio: float
    low: float
    high: float


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

    def as_dict(self, group: str) -> dict[str, Any]:
        """Return the figure with all samples for the JSON that :func:`read_run` reads."""
        judged = {"ratio": self.ratio, "spread": self.spread, "verdict": self.verdict}
        return {**asdict(self), "group": group, **judged}

    def slower(self, before: Recorded) -> float:
        """Return the relative change since a recorded run, positive if the figure became slower.

        It is zero up to :data:`RESOLUTION`, and where the percentiles overlap.
        """
        low, high = self.spread
        change = self.ratio / before.ratio - 1.0
        return change if abs(change) > RESOLUTION and (low > before.high or high < before.low) else 0.0


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


def read_run(path: Path) -> tuple[str, Mapping[str, Recorded]]:
    """Return the commit of a run that ``hsv bench --json`` printed to a file, and its figures by name.

    Raises:
        QuantityError: It cannot be read, or is no such output.
    """
    try:
        run = parse_json(read_text(path))
        figures = {
            str(figure["name"]): Recorded(str(figure["group"]), float(figure["ratio"]), *map(float, figure["spread"]))
            for figure in run["figures"]
        }
        if not all(figure.ratio > 0.0 for figure in figures.values()):
            raise ValueError("a ratio that is not positive")
        return str(run["commit"]), figures
    except (DocumentError, KeyError, TypeError, ValueError) as error:
        raise QuantityError(f"compare = {str(path)!r}: {error}, expected the output of hsv bench --json") from error
