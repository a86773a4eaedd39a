"""The paper's figures, drawn from this project's designs and flights; Figures 1 and 7 are block diagrams."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time
from hsv_paper.figures.figure import DRAWN

__all__ = ["FIGURES", "frequency", "invariant_set", "over_time"]

FIGURES = dict(sorted(DRAWN.items()))
"""All figures by the paper's number."""
