"""A figure of the paper, with its page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

_PAGE = """# Figure {number}
Made by `hsv-paper figures --only {number} --out docs/figures`, including its text.

![Figure {number}, ours]({stem}.png)

**The paper's caption.** {caption}

**Shown.** {shown}

**What agrees.** {agrees}

**What differs.** {differs}

`hsv-paper claims` measures what the paper says of its figures.
"""


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper: its number and caption, how it is drawn, the text of its page, and its scenarios."""

    number: int
    caption: str
    draw: Callable[[], Figure]
    shown: str
    agrees: str
    differs: str
    scenarios: tuple[str, ...] = ()

    @property
    def stem(self) -> str:
        """Name of the figure's files without extension."""
        return f"figure_{self.number:02}"

    @property
    def page(self) -> str:
        """The page in Markdown."""
        runs = ", ".join(f"`hsv run {name}`" for name in self.scenarios)
        text = _PAGE.format(stem=self.stem, **vars(self))
        return text + (f"\nThe flights can be repeated with {runs}.\n" if runs else "")
