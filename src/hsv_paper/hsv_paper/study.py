"""The runner of all studies, sensitivities and physical limits alike: a study makes a figure, text and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.processes import Progress
from hsv.flight.corners import Corner, screening_corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Flights

Rows = Sequence[Mapping[str, Any]]
"""A table: its rows, each with a cell (text, rounded number or ``None``) by column."""

_PAGE = """# {kind}: {title}
Made by `hsv-paper {command} --out docs/study`, including all numbers; [terms](index.md#terms).

![{title}]({name}.png)

{parts}
"""


@dataclass(frozen=True)
class Scope:
    """How fine a study is (coarseness 1: as in the docs), the folder of its flights, and where it reports progress.

    ``additional``: scenarios whose controllers are flown, too.
    """

    coarseness: float
    folder: Path
    progress: Progress = lambda what, done, total: None
    additional: Sequence[str] = ()

    @cached_property
    def flights(self) -> Flights:
        """The flights of the study."""
        return Flights(self.folder, self.progress)

    @property
    def every(self) -> int:
        """One in so many values of a list is used."""
        return max(1, round(self.coarseness))

    @cached_property
    def over(self) -> list[Corner]:
        """The nominal vehicle and 32 corners of the parameter bounds, fewer if coarse."""
        return self.corners(1.0)

    def corners(self, scale: float) -> list[Corner]:
        """Return the nominal vehicle and 32 corners of ``scale`` times the parameter bounds, fewer if coarse."""
        return screening_corners(load_vehicle().uncertainty, scale)[:: self.every]

    def grid(self, low: float, high: float, step: float) -> np.ndarray:
        """Return values from ``low`` to ``high``, ``step`` apart, or farther if coarse."""
        return np.linspace(low, high, max(2, round((high - low) / (step * self.coarseness)) + 1))

    def count(self, number: int, least: int) -> int:
        """Return how many of a ``number`` of points are used, at least ``least``."""
        return max(least, round(number / self.coarseness))


class Outcome:
    """Results of a study: its figure, and the parts of its page, text and tables, in their order."""

    def __init__(self, figure: Figure, *parts: str | Rows) -> None:
        """Keep the figure and the parts."""
        self.figure, self.parts = figure, parts

    @property
    def tables(self) -> list[Rows]:
        """The tables among the parts."""
        return [part for part in self.parts if not isinstance(part, str)]


@dataclass(frozen=True)
class Study:
    """A study: its title, its function, and about how many minutes it takes on one processor.

    ``flies_others``: it can fly the controllers of further scenarios.
    """

    name: str
    title: str
    run: Callable[[Scope], Outcome]
    minutes: float
    kind: str = "Sensitivity"
    flies_others: bool = False

    def page(self, outcome: Outcome) -> str:
        """Return the page in Markdown."""
        command = self.name if self.name == "limits" else f"sensitivity {self.name}"
        parts = "\n\n".join(part if isinstance(part, str) else markdown(part) for part in outcome.parts)
        return _PAGE.format(kind=self.kind, title=self.title, command=command, name=self.name, parts=parts)


def markdown(rows: Rows, right: Sequence[str] | None = None) -> str:
    """Return a table in Markdown; "–" stands for ``None``.

    Args:
        rows: Rows with the same columns.
        right: Columns that are aligned right; by default all but the first.
    """
    heads = list(rows[0])
    lines = [heads, ["---:" if head in (heads[1:] if right is None else right) else "---" for head in heads]]
    lines += [
        ["–" if cell is None else cell if isinstance(cell, str) else f"{cell:g}" for cell in row.values()]
        for row in rows
    ]
    head, *body = (f"| {' | '.join(line)} |" for line in lines)
    return "\n".join((head.replace("|  |", "| |"), *body))


def rounded(value: float | None, digits: int = 0) -> float | None:
    """Return a number as a cell; ``None`` where there is none or it is not finite."""
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


def in_words(over: Sequence[Corner]) -> str:
    """Return which vehicles ``over`` has: the nominal one, and some of all corners."""
    return f"nominal vehicle and {len(over) - 1} of the {2 ** len(load_vehicle().uncertainty)} corners"
