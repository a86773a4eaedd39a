"""The strip over the inertial coupling, kappa times the derived set."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsv.study.figures.style import GREY, letter, new_figure, plain_log
from hsv.study.sensitivity.controllers import ALL, Controller, corners_of, flown, growth
from hsv.study.sensitivity.flights_strip import Strip, draw_metric, finding, legend, strip
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid, lost_from
from hsv.vehicle.parameters import vehicle_parameters


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly and linearise every controller at kappa from 0 to 1.25."""
    kappas = grid(0.0, 1.25, 0.05, coarseness)
    over = corners_of(1.0)[:: max(1, round(2 * coarseness))]
    vehicles = [vehicle_parameters("derived").with_coupling_scale(float(kappa)) for kappa in kappas]
    growths: dict[Controller, list[list[float]]] = {}
    strips: dict[Controller, Strip] = {}
    total = len(ALL) * len(kappas)
    for number, controller in enumerate(ALL):
        tables, growths[controller] = [], []
        for index, (kappa, vehicle) in enumerate(zip(kappas, vehicles, strict=True)):
            progress("coupling", number * len(kappas) + index, total)
            tables.append(flown(controller, over, float(kappa)))
            growths[controller].append([growth(controller, vehicle.perturbed(corner)) for corner in over])
        strips[controller] = strip(tables)
    progress("coupling", total, total)

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    findings = []
    for controller, rows in growths.items():
        values = np.array(rows)
        axes[0].plot(kappas, values[:, 0], color=controller.color, label=controller.label)
        axes[0].plot(kappas, values.max(axis=1), "--", color=controller.color, linewidth=0.9)
        unstable = [lost_from(kappas, values[:, 0] < 0.0), lost_from(kappas, values.max(axis=1) < 0.0)]
        said = ["nowhere" if kappa is None else f"from κ = {kappa:.2f} on" for kappa in unstable]
        findings.append(
            f"{controller.label}: linear loop unstable {said[0]} (nominal), {said[1]} (worst corner); "
            + finding(controller, kappas, strips[controller], lambda kappa: f"κ = {kappa:.2f}").split(": ")[1]
        )
    axes[0].axhline(0.0, color="black", linewidth=0.6)
    axes[0].set_ylim(-0.5, 1.5)
    axes[0].set_ylabel("largest real part (1/s)")
    draw_metric(axes[1], kappas, strips, "elastic_decay_time", "s", "elastic decay (s)")
    draw_metric(axes[2], kappas, strips, "post_fault_attitude_deviation", "rad", "attitude excursion (deg)")
    plain_log(axes[2])
    axes[2].set_xlabel(r"coupling $\kappa$ (1: derived from a beam model)")
    for axis in axes:
        for kappa in (0.25, 1.0):
            axis.axvline(kappa, color=GREY, linewidth=0.6, linestyle=":")
    axes[0].text(0.255, 1.32, "paper-like", color=GREY, fontsize=8)
    axes[0].text(0.995, 1.32, "derived", color=GREY, fontsize=8, ha="right")
    letter(axes)
    legend(figure, shares=False)
    return Outcome(
        figure,
        f"Case 1 on the coupled model, nominal vehicle (solid) and the worst of {len(over) - 1} corners of the "
        "parameters (dashed); (a) linear sampled loop, before and after the fault, at both ends of the step; (b), (c) "
        "flights, a line ends where one is lost; a decay of 100 s: not before the end of the flight.",
        tuple(findings),
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {c.label: rows for c, rows in growths.items()},
            "flights": {c.label: columns for c, columns in strips.items()},
        },
    )


STUDY = Study("coupling", "Inertial coupling", run)
