"""The paper's figures, drawn from this project's designs and flights; Figures 1 and 7 are block diagrams."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time

FIGURES = dict(sorted({**frequency.FIGURES, 6: invariant_set.figure_06, **over_time.FIGURES}.items()))
"""The function that draws each figure, by the paper's number."""
