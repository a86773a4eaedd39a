"""The common parts of all sensitivity studies: a study makes a figure, text and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.processes import Progress
from hsv.flight.corners import Corner, screening_corners
from hsv.model.vehicle import load_vehicle

Rows = Sequence[Mapping[str, Any]]
"""The rows of a table. A row maps each column to a cell: text, a rounded number, or None."""

_PAGE = """# Sensitivity: {title}
Made by `hsv-paper sensitivity {name} --out docs/study`, including all numbers.

![{title}]({name}.png)

{parts}
"""

_TERMS = """## Terms
- *Growth* is the largest real part (1/s) of the poles of the linear sampled loop, over both ends of Case 1's step,
  before and after the fault. The loop is stable below zero; limits of stability are found by root finding.
- Lines are solid for the nominal vehicle, and dashed for the worst of the corners of the parameter bounds. They end
  where a flight is lost.
- A flight counts as *saturated* if its inputs are at their limits for more than a second, or if it is lost.
- *RMPC*, robust MPC, flies the fourth gain of the nominal family."""


@dataclass(frozen=True)
class Scope:
    """The resolution of a study, and its report of progress. Coarseness 1 is that of the docs."""

    coarseness: float
    progress: Progress = lambda what, done, total: None

    @property
    def every(self) -> int:
        """Stride in lists of values: with a stride of n, every n-th value is used."""
        return max(1, round(self.coarseness))

    @cached_property
    def over(self) -> list[Corner]:
        """The nominal vehicle and 32 corners of the parameter bounds, fewer if coarse."""
        return self.corners(1.0)

    def corners(self, scale: float) -> list[Corner]:
        """Return the nominal vehicle and 32 corners of ``scale`` times the parameter bounds, fewer if coarse."""
        return screening_corners(load_vehicle().uncertainty, scale)[:: self.every]

    def grid(self, low: float, high: float, step: float) -> np.ndarray:
        """Return values from ``low`` to ``high`` with a spacing of about ``step`` times the coarseness."""
        return np.linspace(low, high, max(2, round((high - low) / (step * self.coarseness)) + 1))

    def count(self, number: int, least: int) -> int:
        """Return the ``number`` of points divided by the coarseness, but at least ``least``."""
        return max(least, round(number / self.coarseness))


class Outcome:
    """The results of a study: its figure, and the text and tables of its page in their order."""

    def __init__(self, figure: Figure, *parts: str | Rows) -> None:
        self.figure, self.parts = figure, parts

    @property
    def tables(self) -> list[Rows]:
        """The tables of the page."""
        return [part for part in self.parts if not isinstance(part, str)]


@dataclass(frozen=True)
class Study:
    """A study: its title, the function that runs it, and about how many minutes it takes on one processor."""

    name: str
    title: str
    run: Callable[[Scope], Outcome]
    minutes: float

    def page(self, outcome: Outcome) -> str:
        """Return the study's page in Markdown."""
        parts = [part if isinstance(part, str) else markdown(part) for part in outcome.parts]
        return _PAGE.format(title=self.title, name=self.name, parts="\n\n".join([*parts, _TERMS]))


def markdown(rows: Rows, right: Sequence[str] | None = None) -> str:
    """Return a table in Markdown, with a dash for None; ``right`` are right-aligned columns, default: all but one."""
    heads = list(rows[0])
    lines = [heads, ["---:" if head in (heads[1:] if right is None else right) else "---" for head in heads]]
    lines += [
        ["–" if cell is None else cell if isinstance(cell, str) else f"{cell:g}" for cell in row.values()]
        for row in rows
    ]
    head, *body = (f"| {' | '.join(line)} |" for line in lines)
    return "\n".join((head.replace("|  |", "| |"), *body))


def rounded_cell(value: float | None, digits: int = 0) -> float | None:
    """Return a number, rounded to ``digits`` decimals, as a cell; None if it is None or not finite."""
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


def vehicles(over: Sequence[Corner]) -> str:
    """Return in words which vehicles ``over`` has: the nominal one, and how many of all corners."""
    return f"nominal vehicle and {len(over) - 1} of the {2 ** len(load_vehicle().uncertainty)} corners"
