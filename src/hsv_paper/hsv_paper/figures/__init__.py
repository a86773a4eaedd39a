"""The paper's figures, drawn from this project's designs and flights."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time
from hsv_paper.figures.figure import PaperFigure

_FOUND = [found for module in (frequency, invariant_set, over_time) for found in vars(module).values()]

FIGURES = {
    figure.number: figure
    for figure in sorted((f for f in _FOUND if isinstance(f, PaperFigure)), key=lambda figure: figure.number)
}
"""All figures by the paper's number; Figures 1 and 7 are block diagrams."""
