"""A figure of the paper, with its page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hsv_paper.flights import Flights
from hsv_paper.study import Outcome

Draw = Callable[[Flights], Outcome]
"""A function that draws a figure; its parts are what is shown, what agrees with the paper, and what differs."""

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
    """A figure of the paper: its number, its caption, how it is drawn, and the scenarios that it shows."""

    number: int
    caption: str
    draw: Draw
    scenarios: tuple[str, ...]

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


DRAWN: dict[int, PaperFigure] = {}
"""Figures by number, in the order of their modules."""


def paper_figure(number: int, caption: str, *scenarios: str) -> Callable[[Draw], Draw]:
    """Add the function that draws a figure to :data:`DRAWN`."""

    def added(draw: Draw) -> Draw:
        DRAWN[number] = PaperFigure(number, caption, draw, scenarios)
        return draw

    return added
