"""The strip over the size of the parameter perturbations."""

from __future__ import annotations

from pathlib import Path

from hsv.study.figures.style import GREY, letter, new_figure, plain_log
from hsv.study.sensitivity.controllers import ALL, Controller, corners_of, flown
from hsv.study.sensitivity.flights_strip import Strip, draw_metric, draw_share, finding, legend, strip
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly every controller with 0 to 6 times the paper's bounds."""
    scales = grid(0.0, 6.0, 0.25, coarseness)
    every = max(1, round(coarseness))
    strips: dict[Controller, Strip] = {}
    total = len(ALL) * len(scales)
    for number, controller in enumerate(ALL):
        tables = []
        for index, scale in enumerate(scales):
            progress("parameters", number * len(scales) + index, total)
            tables.append(flown(controller, corners_of(float(scale))[::every]))
        strips[controller] = strip(tables)
    progress("parameters", total, total)

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_share(axes[0], scales, strips)
    draw_metric(axes[1], scales, strips, "post_fault_attitude_deviation", "rad", "attitude excursion (deg)")
    draw_metric(axes[2], scales, strips, "altitude_end_error", "m", "altitude error at end (ft)")
    for axis in axes[1:]:
        plain_log(axis)
    for axis in axes:
        axis.axvline(1.0, color=GREY, linewidth=0.6, linestyle=":")
    axes[2].set_xlabel("parameter scale (1: the paper's bounds, mass and moment of inertia 10 %)")
    letter(axes)
    legend(figure, shares=True)
    return Outcome(
        figure,
        "Case 1 on the coupled model, paper-like coupling, the vehicle at 32 corners of the scaled bounds. (a) Share "
        "of flights that come to their end (solid), and without a second at the limits of the inputs (dotted); (b), "
        "(c) nominal vehicle solid, worst corner dashed, a line ends where a flight is lost.",
        tuple(
            finding(c, scales, columns, lambda s: f"{s:.2f} times the bounds", nominal=False)
            for c, columns in strips.items()
        ),
        {"scale": scales.tolist(), "flights": {c.label: columns for c, columns in strips.items()}},
    )


STUDY = Study("parameters", "Size of the parameter uncertainty", run)
