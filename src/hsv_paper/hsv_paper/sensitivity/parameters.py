"""The sweep over the size of the parameter perturbations."""

from __future__ import annotations

from pathlib import Path

from hsv.base.processes import Progress
from hsv_paper.figures.style import GREY, new_figure
from hsv_paper.sensitivity.controllers import ALL, RMPC_DECOUPLED, SAID_RMPC, corners_of, said_corners
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_figures import LOSSES, draw_losses, finding

FLOWN = (*ALL, RMPC_DECOUPLED)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly every controller with 0 to 6 times the paper's bounds."""
    scales = grid(0.0, 6.0, 0.25, coarseness)
    over = [corners_of(float(scale), coarseness) for scale in scales]
    results = sweep("parameters", {c: [Point(c.parameters(), o) for o in over] for c in FLOWN}, folder, progress)

    figure = new_figure(7.2)
    label = "parameter scale (1: the paper's bounds, mass and moment of inertia 10 %)"
    for axis in draw_losses(figure, scales, {c: results[c] for c in ALL}, label):
        axis.axvline(1.0, color=GREY, linewidth=0.6, linestyle=":")
    return Outcome(
        figure,
        "Case 1 on the coupled model with the paper-like coupling, flown with the nominal vehicle and "
        f"{said_corners(over[0])} of the scaled bounds. {LOSSES} {SAID_RMPC}.",
        tuple(finding(c, scales, columns, "{} times the bounds", nominal=False) for c, columns in results.items()),
        {"scale": scales.tolist(), "flights": {c.label: columns for c, columns in results.items()}},
    )


STUDY = Study("parameters", "Size of the parameter uncertainty", run)
