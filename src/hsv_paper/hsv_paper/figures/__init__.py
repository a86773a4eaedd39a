"""The paper's figures, drawn from our designs and flights. Figures 1 and 7, block diagrams, are left out."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time

FIGURES = dict(sorted({**frequency.FIGURES, 6: invariant_set.figure_06, **over_time.FIGURES}.items()))
"""The functions that draw the figures, by the paper's number."""
