"""The length of Case 2's ramp, which the paper does not give."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.control.design import find_design, read_parameters
from hsv.flight.scenario import load_scenario
from hsv.flight.tables import CommandTable
from hsv_paper.figures.style import BLUE, GREEN, GREY, ORANGE, letter, new_figure
from hsv_paper.sensitivity.controllers import Controller, corners_of, said_corners
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_figures import SATURATED, draw_metric, legend
from hsv_paper.sensitivity.sweep_result import SweepResult

CONTROLLERS = (
    Controller("baseline", "case2_baseline", ORANGE),
    Controller("adjustable, tau = 1", "case2_tau1", GREEN, "adjustable"),
    Controller("adjustable, tau = 0.8", "case2", BLUE, "adjustable"),
)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly Case 2 with ramps of 15 s to 80 s; the last ends when the fault occurs."""
    lengths = grid(15.0, 80.0, 5.0, coarseness)
    over = corners_of(1.0, coarseness)
    along = {c: [Point(_values(c, float(length)), over) for length in lengths] for c in CONTROLLERS}
    results = sweep("ramp", along, folder, progress)
    shipped = _command(CONTROLLERS[0])

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_metric(axes[0], lengths, results, "altitude_error_maximum", "m", "largest altitude error (ft)")
    draw_metric(axes[1], lengths, results, "velocity_error_maximum", "m/s", "largest velocity error (ft/s)")
    draw_metric(axes[2], lengths, results, "post_fault_attitude_from_nominal", "rad", "attitude from nominal (deg)")
    axes[2].axhline(0.5, color="black", linewidth=0.6)
    for axis in axes:
        axis.axvline(shipped.end - shipped.start, color=GREY, linewidth=0.6, linestyle=":")
    for controller in CONTROLLERS:
        axes[0].plot([], [], color=controller.color, label=controller.label)
    axes[2].set_xlabel(f"length of the ramp (s); {shipped.end - shipped.start:g} s: the shipped scenarios")
    letter(axes)
    legend(figure, shares=False)
    return Outcome(
        figure,
        f"Case 2 with a ramp that starts at {shipped.start:g} s; nominal vehicle (solid) and the worst of "
        f"{said_corners(over)} of the parameter bounds (dashed). The ramp of {lengths[-1]:g} s ends when the fault "
        "occurs, so that its largest error includes the effect of the fault. (c) Attitude deviation from nominal "
        f"after the fault; the black line is half a degree. {SATURATED}",
        tuple(_finding(controller, lengths, columns) for controller, columns in results.items()),
        {"length_s": lengths.tolist(), "flights": {c.label: columns for c, columns in results.items()}},
    )


def _command(controller: Controller) -> CommandTable:
    """Return the one command of a controller's scenario, the ramp."""
    (command,) = load_scenario(controller.scenario).command
    return command


def _values(controller: Controller, length: float) -> dict[str, object]:
    command = _command(controller)
    ramp = command.model_copy(update={"end": command.start + length})
    changed = load_scenario(controller.scenario).model_copy(update={"command": (ramp,)})
    return {**read_parameters(find_design(controller.design)), **changed.parameters()}


def _finding(controller: Controller, lengths: np.ndarray, columns: SweepResult) -> str:
    feet, degrees = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]

    def errors(index: int, which: str) -> str:
        altitude, velocity = (columns[f"{axis}_error_maximum_{which}"][index] for axis in ("altitude", "velocity"))
        return f"{feet * altitude:.0f} ft and {feet * velocity:.1f} ft/s"

    ends = "; ".join(
        f"with a ramp of {lengths[i]:g} s, the largest errors are {errors(i, 'nominal')} (nominal vehicle) and "
        f"{errors(i, 'worst')} (worst corner)"
        for i in (0, -1)
    )
    attitude = degrees * np.array(columns["post_fault_attitude_from_nominal_worst"])
    limited = lengths[np.array(columns["without_limits"]) < 1.0]
    met = f"flights are saturated with ramps up to {limited.max():g} s" if len(limited) else "no flight is saturated"
    return (
        f"{controller.label}: {ends}; the worst attitude deviation from nominal after the fault is "
        f"{attitude.min():.3f} to {attitude.max():.3f} deg; {met}"
    )


STUDY = Study("ramp", "Length of the ramp", run)
