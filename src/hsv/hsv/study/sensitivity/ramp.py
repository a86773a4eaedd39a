"""The length of Case 2's ramp, which the paper does not give."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsv.control.design_file import find_design, read_parameters
from hsv.simulation.scenario import parse_scenario, scenario_text
from hsv.study.corner_flights import fly_over
from hsv.study.figures.style import BLUE, GREEN, GREY, ORANGE, letter, new_figure
from hsv.study.sensitivity.controllers import HALF_WIDTH, Controller, corners_of
from hsv.study.sensitivity.flights_strip import Strip, draw_metric, legend, strip
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid
from hsv.units import to_paper

CONTROLLERS = (
    Controller("baseline", "case2_baseline", ORANGE),
    Controller("adjustable, tau = 1", "case2_tau1", GREEN, "adjustable"),
    Controller("adjustable, tau = 0.8", "case2", BLUE, "adjustable"),
)
START, SHIPPED = 20.0, 60.0
"""s: when the ramp starts, and how long it is in the shipped scenarios."""


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly Case 2 with ramps of 15 s to 80 s; the last ends as the fault sets in."""
    lengths = grid(15.0, 80.0, 5.0, coarseness)
    over = corners_of(1.0)[:: max(1, round(coarseness))]
    strips: dict[Controller, Strip] = {}
    total = len(CONTROLLERS) * len(lengths)
    for number, controller in enumerate(CONTROLLERS):
        design, text, tables = read_parameters(find_design(controller.design)), scenario_text(controller.scenario), []
        for index, length in enumerate(lengths):
            progress("ramp", number * len(lengths) + index, total)
            changed = text.replace(f'end = "{START + SHIPPED:g} s"', f'end = "{START + length:g} s"')
            values = {**design, **parse_scenario(changed, controller.scenario).parameters()}
            tables.append(fly_over(values, over, HALF_WIDTH))
        strips[controller] = strip(tables)
    progress("ramp", total, total)

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_metric(axes[0], lengths, strips, "altitude_error_maximum", "m", "largest altitude error (ft)")
    draw_metric(axes[1], lengths, strips, "velocity_error_maximum", "m/s", "largest velocity error (ft/s)")
    draw_metric(axes[2], lengths, strips, "post_fault_attitude_from_nominal", "rad", "attitude from nominal (deg)")
    axes[2].axhline(0.5, color="black", linewidth=0.6)
    for axis in axes:
        axis.axvline(SHIPPED, color=GREY, linewidth=0.6, linestyle=":")
    for controller in CONTROLLERS:
        axes[0].plot([], [], color=controller.color, label=controller.label)
    axes[2].set_xlabel("length of the ramp (s); 60 s: the shipped scenarios")
    letter(axes)
    legend(figure, shares=False)
    return Outcome(
        figure,
        f"Case 2 with the ramp from 20 s on; nominal vehicle and {len(over) - 1} corners of the parameters. The one of "
        "80 s ends as the fault sets in, whose error its largest then holds. (c) After the fault, black: half a "
        "degree.",
        tuple(_finding(controller, lengths, columns) for controller, columns in strips.items()),
        {"length_s": lengths.tolist(), "flights": {c.label: columns for c, columns in strips.items()}},
    )


def _finding(controller: Controller, lengths: np.ndarray, columns: Strip) -> str:
    altitude = to_paper(1.0, "m")[0] * np.array(columns["altitude_error_maximum_nominal"])
    velocity = to_paper(1.0, "m/s")[0] * np.array(columns["velocity_error_maximum_nominal"])
    limited = lengths[np.array(columns["without_limits"]) < 1.0]
    met = f"inputs limited for ramps up to {limited.max():g} s" if len(limited) else "inputs never limited"
    return (
        f"{controller.label}: nominal vehicle {altitude[0]:.0f} ft and {velocity[0]:.1f} ft/s off at most with a ramp "
        f"of {lengths[0]:g} s, {altitude[-1]:.0f} ft and {velocity[-1]:.1f} ft/s with one of {lengths[-1]:g} s; {met}"
    )


STUDY = Study("ramp", "Length of the ramp", run)
