"""Definition, scope and page of a study: a sensitivity, or a physical limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.processes import Progress
from hsv.flight.corners import Corner, screening_corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Flights

_PAGE = """# {kind}: {title}
Made by `hsv-paper {command} --out docs/study`, including all numbers.

![{title}]({name}.png)

{shows}

{findings}
"""


@dataclass(frozen=True)
class Scope:
    """How fine a study is (coarseness 1: as in the docs), where its flights are kept, and whom to tell of progress.

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


@dataclass(frozen=True)
class Outcome:
    """Results of a study: its figure, a description of the figure, the findings, and the numbers behind them (SI)."""

    figure: Figure
    shows: str
    findings: Sequence[str]
    numbers: dict[str, Any] = field(default_factory=dict)


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
    command: str = "sensitivity"
    flies_others: bool = False

    def page(self, outcome: Outcome) -> str:
        """Return the page in Markdown."""
        command = self.command if self.command == self.name else f"{self.command} {self.name}"
        findings = "\n".join(f"- {finding[0].upper()}{finding[1:]}." for finding in outcome.findings)
        return _PAGE.format(
            kind=self.kind,
            title=self.title,
            command=command,
            name=self.name,
            shows=outcome.shows,
            findings=findings,
        )


def in_words(over: Sequence[Corner]) -> str:
    """Return the number of corners in ``over`` besides the nominal vehicle, and the number of all."""
    return f"{len(over) - 1} of the {2 ** len(load_vehicle().uncertainty)} corners"
