"""Definition and results of a sensitivity study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.processes import Progress


@dataclass(frozen=True)
class Outcome:
    """Results of a study: its figure, a sentence on what is shown, the findings, and the numbers behind it (SI)."""

    figure: Figure
    shows: str
    findings: tuple[str, ...]
    numbers: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A study; ``run`` takes the coarseness (1: as in the docs), a folder for designs, and a progress callback.

    ``run_beside``, if there is one, also flies the controllers of the scenarios in its last argument. ``kind``: what
    the title of its page begins with.
    """

    name: str
    title: str
    run: Callable[[float, Path, Progress], Outcome]
    run_beside: Callable[[float, Path, Progress, Sequence[str]], Outcome] | None = None
    kind: str = "Sensitivity"


def grid(low: float, high: float, step: float, coarseness: float) -> np.ndarray:
    """Return values from ``low`` to ``high``, ``step`` apart where ``coarseness`` is 1, fewer where it is larger."""
    count = max(2, round((high - low) / (step * coarseness)) + 1)
    return np.linspace(low, high, count)
