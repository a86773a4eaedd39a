"""All figures of the study, by the paper's number."""

from __future__ import annotations

from hsv_paper.figures import (
    figure_02,
    figure_03,
    figure_04,
    figure_05,
    figure_06,
    figure_08,
    figure_09,
    figure_10,
    figure_11,
    figure_12,
    figure_13,
    figure_14,
    figure_15,
    figure_16,
    figure_17,
)
from hsv_paper.figures.figure import PaperFigure

FIGURES: dict[int, PaperFigure] = {
    module.FIGURE.number: module.FIGURE
    for module in (
        figure_02,
        figure_03,
        figure_04,
        figure_05,
        figure_06,
        figure_08,
        figure_09,
        figure_10,
        figure_11,
        figure_12,
        figure_13,
        figure_14,
        figure_15,
        figure_16,
        figure_17,
    )
}
"""Figures 1 and 7 are block diagrams."""
