"""The page of a figure: the picture, the paper's caption, and what agrees and what differs."""

from __future__ import annotations

from hsv_paper.figures.figure import Drawing, PaperFigure

_PAGE = """# Figure {number}
Made by `hsv-paper figures --only {number} --out docs/figures`, including all numbers.

![Figure {number}, ours]({stem}.png)

**The paper's caption.** {caption}

**Shown.** {shows}

**What agrees.** {agrees}

**What differs.** {differs}
{runs}"""


def page(figure: PaperFigure, drawing: Drawing) -> str:
    """Return the page in Markdown."""
    runs = f"\nThe flights can be repeated with {', '.join(f'`hsv run {name}`' for name in figure.scenarios)}.\n"
    return _PAGE.format(
        number=figure.number,
        stem=figure.stem,
        caption=figure.caption,
        shows=drawing.shows,
        agrees=drawing.agrees,
        differs=drawing.differs,
        runs=runs if figure.scenarios else "",
    )
