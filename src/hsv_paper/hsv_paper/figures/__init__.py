"""The paper's figures, drawn from this project's designs and flights; Figures 1 and 7 are block diagrams."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time

FIGURES = {
    figure.number: figure
    for figure in sorted((*frequency.FIGURES, invariant_set.FIGURE, *over_time.FIGURES), key=lambda each: each.number)
}
"""All figures by the paper's number."""
