"""The strip over the depth of the elevator fault."""

from __future__ import annotations

from pathlib import Path

from hsv.study.figures.style import GREY, letter, new_figure, plain_log
from hsv.study.sensitivity.controllers import ALL, Controller, corners_of, flown
from hsv.study.sensitivity.flights_strip import Strip, draw_metric, draw_share, finding, legend, strip
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly every controller with an elevator effectiveness from 1 down to 0.3."""
    shares = grid(0.3, 1.0, 0.025, coarseness)
    over = corners_of(1.0)[:: max(1, round(coarseness))]
    strips: dict[Controller, Strip] = {}
    total = len(ALL) * len(shares)
    for number, controller in enumerate(ALL):
        tables = []
        for index, left in enumerate(shares):
            progress("fault", number * len(shares) + index, total)
            tables.append(flown(controller, over, fault__values=[float(left)]))
        strips[controller] = strip(tables)
    progress("fault", total, total)

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_share(axes[0], shares, strips)
    draw_metric(axes[1], shares, strips, "post_fault_attitude_deviation", "rad", "attitude excursion (deg)")
    draw_metric(axes[2], shares, strips, "altitude_end_error", "m", "altitude error at end (ft)")
    for axis in axes[1:]:
        plain_log(axis)
    # Without a fault hardly anything moves: that end of the curves would take most of the axis.
    axes[1].set_ylim(bottom=0.05)
    axes[2].set_ylim(bottom=1.0)
    for axis in axes:
        axis.axvline(0.9, color=GREY, linewidth=0.6, linestyle=":")
        axis.set_xlim(1.0, 0.3)
    axes[2].set_xlabel("elevator effectiveness after the fault (0.9: the paper's)")
    letter(axes)
    legend(figure, shares=True)
    return Outcome(
        figure,
        f"Case 1 on the coupled model, paper-like coupling; nominal vehicle and {len(over) - 1} corners of the "
        "parameters. (a) Share of flights that come to their end (solid), and without a second at the limits of the "
        "inputs (dotted); (b), (c) nominal vehicle solid, worst corner dashed, a line ends where a flight is lost.",
        tuple(
            finding(c, shares, columns, lambda s: f"effectiveness {s:.3g}", rising=False)
            for c, columns in strips.items()
        ),
        {"effectiveness": shares.tolist(), "flights": {c.label: columns for c, columns in strips.items()}},
    )


STUDY = Study("fault", "Depth of the fault", run)
