"""The sampling period: the same design inputs at 0.01 s, 0.02 s and 0.05 s."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from hsv.control.design_file import ControlDesign, find_design, read_design, write_design
from hsv.control.notch_filter import NotchSection
from hsv.design.baseline import design_gains
from hsv.design.inputs import find_inputs, read_inputs
from hsv.simulation.scenario import load_scenario
from hsv.study.corner_flights import fly_over
from hsv.study.figures.style import BLUE, GREEN, GREY, RED, letter, new_figure
from hsv.study.linear_loop import worst_growth
from hsv.study.sensitivity.controllers import HALF_WIDTH, corners_of
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid, lost_from
from hsv.study.sources import DIGITS, code_digest, package_digest
from hsv.units import to_paper
from hsv.vehicle.parameters import vehicle_parameters

PERIODS = (0.01, 0.02, 0.05)
COLORS = (GREEN, BLUE, RED)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Design at each period, linearise over the coupling with and without notch, and fly Case 1."""
    kappas = grid(0.0, 1.25, 0.05, coarseness)
    designs = {period: _design(period, folder, progress) for period in PERIODS}
    growths: dict[float, dict[str, list[float]]] = {}
    for period, design in designs.items():
        growths[period] = {"with": [], "without": []}
        for index, kappa in enumerate(kappas):
            progress(f"sampling, T = {period:g} s", index, len(kappas))
            for name, notch in (("with", design.notch), ("without", ())):
                growths[period][name].append(_growth(design, float(kappa), notch))
        progress(f"sampling, T = {period:g} s", len(kappas), len(kappas))
    over = corners_of(1.0)[:: max(1, round(2 * coarseness))]
    flights = {}
    for period, design in designs.items():
        values = {**design.to_parameters(), **load_scenario("case1").parameters()}
        # The integration keeps its step, whatever the control period.
        values["substeps"] = max(1, round(period / 0.01))
        flights[period] = fly_over(values, over, HALF_WIDTH)

    figure = new_figure(5.6)
    axes = figure.subplots(2, 1, sharex=True)
    for axis, name in zip(axes, ("with", "without"), strict=True):
        for (period, rows), color in zip(growths.items(), COLORS, strict=True):
            axis.plot(kappas, rows[name], color=color, label=f"$T$ = {period:g} s")
        axis.axhline(0.0, color="black", linewidth=0.6)
        axis.set_ylabel("largest real part (1/s)")
        axis.set_title(f"{name} notch", loc="right")
        for kappa in (0.25, 1.0):
            axis.axvline(kappa, color=GREY, linewidth=0.6, linestyle=":")
    axes[1].set_xlabel(r"coupling $\kappa$ (0.25: paper-like, 1: derived)")
    axes[0].legend(loc="upper left")
    letter(axes)
    findings = []
    for period, table in flights.items():
        limits = [lost_from(kappas, np.array(growths[period][name]) < 0.0) for name in ("with", "without")]
        said = ["nowhere" if kappa is None else f"from κ = {kappa:.2f} on" for kappa in limits]
        attitude = [to_paper(float(v), "rad")[0] for v in _ends(table["post_fault_attitude_deviation"])]
        decay = _ends(table["elastic_decay_time"])
        findings.append(
            f"T = {period:g} s: linear loop unstable {said[0]} with the notch, {said[1]} without; Case 1 with the "
            f"paper-like coupling: attitude excursion {attitude[0]:.3f} deg (worst of {len(over) - 1} corners "
            f"{attitude[1]:.3f} deg), decay {decay[0]:.1f} s ({decay[1]:.1f} s), {int(table['diverged'].sum())} "
            "flights lost"
        )
    return Outcome(
        figure,
        "The baseline's inputs designed anew at each period (polytopic model, F, K), notch at 15 rad/s discretised at "
        "that period; largest real part of the sampled loop's poles over the coupling, nominal vehicle, the worst of "
        "both ends of the step, before and after the fault.",
        tuple(findings),
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {f"{period:g} s": rows for period, rows in growths.items()},
        },
    )


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(values[0]), float(values.max())


def _growth(design: ControlDesign, kappa: float, notch: tuple[NotchSection, ...]) -> float:
    vehicle = vehicle_parameters("derived").with_coupling_scale(kappa)
    return worst_growth(vehicle, design.feedback_gain, notch, design.period)


def _design(period: float, folder: Path, progress: Progress) -> ControlDesign:
    """Return the gains of the baseline's inputs at ``period`` (s), designed once and kept."""
    source = find_inputs("baseline")
    inputs = read_inputs(source)
    if period == inputs.model.period:
        return read_design(find_design("baseline"))
    total = hashlib.sha256(
        f"{source.read_text(encoding='utf-8')}{code_digest()}{package_digest('design')}{period}".encode()
    ).hexdigest()
    path = folder / f"design_{1e3 * period:.0f}ms_{total[:DIGITS]}.yaml"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        changed = inputs.model_copy(update={"model": inputs.model.model_copy(update={"period": period})})
        design = design_gains(
            changed, lambda what, done, of: progress(f"design at {period:g} s: {what}", done, of)
        ).design
        write_design(path, design, f"The baseline's gains at a period of {period:g} s, for hsv study sampling.")
    return read_design(path)


STUDY = Study("sampling", "Sampling period", run)
