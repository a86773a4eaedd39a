"""Definition of a figure and its page, and numbers for the remarks, measured on the flights that are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hsv.base.units import to_paper
from hsv.flight.metrics import METRICS, FlightData, flight_metrics
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Flights
from hsv_paper.study import Outcome

_LIMITS = load_vehicle().decoupled

LIMITS = (
    f"{_LIMITS.input_minimum[0]:g} to {_LIMITS.input_maximum[0]:g} and {np.degrees(_LIMITS.input_minimum[1]):g} deg to "
    f"{np.degrees(_LIMITS.input_maximum[1]):g} deg"
)
"""Limits of both inputs, in words."""

_PAGE = """# Figure {number}
Made by `hsv-paper figures --only {number} --out docs/figures`, including all numbers.

![Figure {number}, ours]({stem}.png)

**The paper's caption.** {caption}

**Shown.** {shows}

**What agrees.** {agrees}

**What differs.** {differs}
"""


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper: its number, its caption, how it is drawn, and the scenarios that it shows.

    The parts of a drawing are three remarks: what is shown, what agrees with the paper, and what differs.
    """

    number: int
    caption: str
    draw: Callable[[Flights], Outcome]
    scenarios: tuple[str, ...] = ()

    @property
    def stem(self) -> str:
        """Name of the figure's files without extension."""
        return f"figure_{self.number:02}"

    def page(self, drawing: Outcome) -> str:
        """Return the page of a drawing in Markdown."""
        shows, agrees, differs = drawing.parts
        text = _PAGE.format(
            number=self.number, stem=self.stem, caption=self.caption, shows=shows, agrees=agrees, differs=differs
        )
        runs = ", ".join(f"`hsv run {name}`" for name in self.scenarios)
        return text + (f"\nThe flights can be repeated with {runs}.\n" if runs else "")


def measured(flights: Flights, scenario: str, metric: str) -> float:
    """Return a metric of a flight in the paper's unit."""
    return to_paper(flight_metrics(flights[scenario])[metric], METRICS[metric].unit)[0]


def input_extremes(flights: Flights, scenarios: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest commands (2) of several flights: fuel ratio, elevator in deg."""
    commands = np.concatenate([flights[scenario].command for scenario in scenarios]) * [1.0, to_paper(1.0, "rad")[0]]
    return commands.min(axis=0), commands.max(axis=0)


def input_ranges(flights: Flights, scenarios: Sequence[str]) -> str:
    """Return the ranges of both commands over several flights, in words."""
    least, largest = input_extremes(flights, scenarios)
    return f"{least[0]:.2f} to {largest[0]:.2f} and {least[1]:.1f} deg to {largest[1]:.1f} deg"


def limited(flights: Flights, scenarios: Sequence[str]) -> str:
    """Return in how many steps of several flights a command was saturated, in words."""
    steps = sum(int(np.any(flights[scenario].flight_curves.saturated, axis=1).sum()) for scenario in scenarios)
    return f"saturated in {steps or 'no'} step{'s' if steps > 1 else ''} of the {len(scenarios)} flights"


def gain_switches(flight: FlightData) -> np.ndarray:
    """Return the steps (s) in which the nominal law switches to another gain of its nested family."""
    return np.flatnonzero(np.diff(flight.gain_index)) + 1


def in_words(values: Sequence[float] | np.ndarray, pattern: str = ".0f") -> str:
    """Return numbers as a list in words: 1, 2 and 3."""
    texts = [format(value, pattern) for value in values]
    return f"{', '.join(texts[:-1])} and {texts[-1]}" if len(texts) > 1 else "".join(texts)
