"""The sampling period: the same design inputs at 0.01 s, 0.02 s and 0.05 s."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.control.design import ControlDesign, find_design, read_design, write_design
from hsv.design.baseline import design_gains
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.scenario import load_scenario
from hsv.flight.sources import DIGITS, code_digest, digest_of, kept, package_digest
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import BLUE, GREEN, GREY, RED, letter, new_figure
from hsv_paper.linear_loop import COUPLING_SCALES, worst_growth
from hsv_paper.sensitivity.controllers import Controller, corners_of, coupling_limits, said_corners
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_result import SweepResult

PERIODS = {
    period: Controller(f"T = {period:g} s", "case1", color)
    for period, color in ((0.01, GREEN), (0.02, BLUE), (0.05, RED))
}
INTEGRATION_STEP = 0.01
"""s: of the vehicle, as at the shipped period."""

FILTERS = ("with the notch", "without")


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Design at each period, linearise over the coupling with and without notch, and fly Case 1."""
    kappas = grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05, coarseness)
    over = corners_of(1.0, coarseness)
    designs = {period: _design(period, folder, progress) for period in PERIODS}
    growths, limits = {}, {}
    for done, (period, design) in enumerate(designs.items()):
        for number, (name, notch) in enumerate(zip(FILTERS, (design.notch, ()), strict=True)):
            progress("sampling, linear loops", len(FILTERS) * done + number, len(FILTERS) * len(designs))
            loop = (design.feedback_gain, notch, period)
            vehicles = [load_vehicle().coupled(float(kappa)) for kappa in kappas]
            growths[period, name] = np.array([[worst_growth(v.perturbed(c), *loop) for c in over] for v in vehicles])
            limits[period, name] = coupling_limits(*loop, over)
    progress("sampling, linear loops", len(growths), len(growths))
    along = {PERIODS[period]: [Point(_values(design), over)] for period, design in designs.items()}
    results = sweep("sampling", along, folder, progress)

    figure, paper_like = new_figure(5.6), load_vehicle().coupling_scale("paper_like")
    axes = figure.subplots(2, 1, sharex=True)
    for axis, name in zip(axes, FILTERS, strict=True):
        for period, controller in PERIODS.items():
            values = growths[period, name]
            axis.plot(kappas, values[:, 0], color=controller.color, label=f"${controller.label}$".replace(" s$", "$ s"))
            axis.plot(kappas, values.max(axis=1), "--", color=controller.color, linewidth=0.9)
        axis.axhline(0.0, color="black", linewidth=0.6)
        axis.set_ylabel("largest real part (1/s)")
        axis.set_title(name, loc="right")
        for kappa in (paper_like, 1.0):
            axis.axvline(kappa, color=GREY, linewidth=0.6, linestyle=":")
    axes[1].set_xlabel(rf"coupling $\kappa$ ({paper_like:g}: paper-like, 1: derived)")
    axes[0].legend(loc="upper left")
    letter(axes)
    return Outcome(
        figure,
        "At each period, the polytopic model, F and K are designed from the baseline's inputs, and its notch is "
        "discretised at that period. The panels show the largest real part of the poles of the sampled loop over the "
        "coupling, over both ends of the step, before and after the fault: nominal vehicle (solid) and the worst of "
        f"{said_corners(over)} of the parameter bounds (dashed). The limits of stability below are found by root "
        "finding.",
        tuple(
            "; ".join(
                (
                    f"{controller.label}: with the notch, {limits[period, FILTERS[0]].said()}",
                    f"without it, {limits[period, FILTERS[1]].said()}",
                    _flown(results[controller]),
                )
            )
            for period, controller in PERIODS.items()
        ),
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {f"{period:g} s, {name}": rows.tolist() for (period, name), rows in growths.items()},
            "unstable_from": {
                f"{period:g} s, {name}": {"nominal": found.nominal, "worst": found.worst}
                for (period, name), found in limits.items()
            },
            "flights": {c.label: columns for c, columns in results.items()},
        },
    )


def _flown(columns: SweepResult) -> str:
    degrees = to_paper(1.0, "rad")[0]
    attitude = [degrees * columns[f"post_fault_attitude_deviation_{which}"][0] for which in ("nominal", "worst")]
    decay = [columns[f"elastic_decay_time_{which}"][0] for which in ("nominal", "worst")]
    lost = 1.0 - columns["finished"][0]
    return (
        f"in Case 1 with the paper-like coupling and the notch, the attitude excursion is {attitude[0]:.3f} deg (worst "
        f"corner {attitude[1]:.3f} deg), the decay time is {decay[0]:.1f} s (worst corner {decay[1]:.1f} s), and "
        + (f"{100.0 * lost:.0f} % of the flights are lost" if lost else "no flight is lost")
    )


def _values(design: ControlDesign) -> dict[str, object]:
    """Return Case 1 with a design; the integration keeps its step, whatever the control period."""
    substeps = max(1, round(design.period / INTEGRATION_STEP))
    return {**design.to_parameters(), **load_scenario("case1").parameters(), "substeps": substeps}


def _design(period: float, folder: Path, progress: Progress) -> ControlDesign:
    """Return the gains of the baseline's inputs at ``period`` (s), designed once and kept."""
    source = find_inputs("baseline")
    inputs = read_inputs(source)
    if period == inputs.model.period:
        return read_design(find_design("baseline"))
    parts = source.read_text(encoding="utf-8"), code_digest(), package_digest("design"), str(period)
    digest = digest_of(part.encode() for part in parts)
    path = folder / f"design_{1e3 * period:.0f}ms_{digest[:DIGITS]}.yaml"

    def made() -> ControlDesign:
        changed = inputs.model_copy(update={"model": inputs.model.model_copy(update={"period": period})})
        return design_gains(
            changed, lambda what, done, of: progress(f"design at {period:g} s: {what}", done, of)
        ).design

    comment = f"The baseline's gains at a period of {period:g} s, for hsv-paper sensitivity sampling."
    return kept(path, made, lambda new, design: write_design(new, design, comment), read_design)


STUDY = Study("sampling", "Sampling period", run)
