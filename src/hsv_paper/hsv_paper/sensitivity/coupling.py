"""The sweep over the inertial coupling, kappa times the derived set."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hsv.base.processes import Progress
from hsv.flight.corners import Corner
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import GREY, letter, new_figure, plain_log
from hsv_paper.linear_loop import COUPLING_SCALES
from hsv_paper.sensitivity.controllers import (
    ALL,
    SAID_RMPC,
    WITHOUT_NOTCH,
    Controller,
    CouplingLimits,
    corners_of,
    coupling_limits,
    feedback,
    growth,
    said_corners,
)
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_figures import SATURATED, draw_metric, legend, lost_where, widths

PAPER_LIKE = load_vehicle().coupling_scale("paper_like")
"""kappa of the paper-like set."""


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly and linearise every controller, beginning at kappa = 0, the decoupled model."""
    kappas = grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05, coarseness)
    over = corners_of(1.0, coarseness)
    results = sweep("coupling", {c: [_point(c, float(k), over) for k in kappas] for c in ALL}, folder, progress)
    growths: dict[Controller, np.ndarray] = {}
    limits: dict[Controller, CouplingLimits] = {}
    for number, controller in enumerate(ALL):
        progress("coupling, linear loops", number, len(ALL))
        growths[controller] = np.array([growth_over(controller, float(kappa), over) for kappa in kappas])
        limits[controller] = coupling_limits(*feedback(controller), over)
    progress("coupling, linear loops", len(ALL), len(ALL))

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    for (controller, values), width in zip(growths.items(), widths(len(ALL)), strict=True):
        axes[0].plot(kappas, values[:, 0], color=controller.color, linewidth=width, label=controller.label)
        axes[0].plot(kappas, values.max(axis=1), "--", color=controller.color, linewidth=width)
    axes[0].axhline(0.0, color="black", linewidth=0.6)
    axes[0].set_ylim(-0.5, 1.5)
    axes[0].set_ylabel("largest real part (1/s)")
    draw_metric(axes[1], kappas, results, "elastic_decay_time", "s", "elastic decay (s)")
    draw_metric(axes[2], kappas, results, "post_fault_attitude_deviation", "rad", "attitude excursion (deg)")
    plain_log(axes[2])
    axes[2].set_xlabel(r"coupling $\kappa$ (0: decoupled, 1: derived from a beam model)")
    for axis in axes:
        for kappa in (PAPER_LIKE, 1.0):
            axis.axvline(kappa, color=GREY, linewidth=0.6, linestyle=":")
    axes[0].text(PAPER_LIKE + 0.005, 1.32, "paper-like", color=GREY, fontsize=8)
    axes[0].text(0.995, 1.32, "derived", color=GREY, fontsize=8, ha="right")
    letter(axes)
    legend(figure, shares=False)
    findings = [f"{c.label}: {limits[c].said()}; {lost_where(kappas, results[c], 'κ = {}')}" for c in ALL]
    return Outcome(
        figure,
        f"Case 1 on the coupled model, with the nominal vehicle (solid) and the worst of {said_corners(over)} of the "
        "parameter bounds (dashed). (a) Largest real part of the poles of the linear sampled loop, over both ends of "
        "the step, before and after the fault; the limits of stability below are found by root finding. (b), (c) "
        "Flights; a line ends where a flight is lost, and a decay time of 100 s means that the rates have not decayed "
        f"by the end of the flight. {SATURATED} {SAID_RMPC}; with κ = 0 and without notch, it is the controller of the "
        "paper, which flies it on the decoupled model only.",
        (*findings, _margin(limits[WITHOUT_NOTCH])),
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {c.label: rows.tolist() for c, rows in growths.items()},
            "unstable_from": {c.label: {"nominal": found.nominal, "worst": found.worst} for c, found in limits.items()},
            "flights": {c.label: columns for c, columns in results.items()},
        },
    )


def growth_over(controller: Controller, kappa: float, over: list[Corner]) -> list[float]:
    """Return the largest real part (1/s) of a controller's loop around each vehicle of ``over`` with ``kappa``."""
    vehicle = load_vehicle().coupled(kappa)
    return [growth(controller, vehicle.perturbed(corner)) for corner in over]


def _point(controller: Controller, kappa: float, over: Sequence[Corner]) -> Point:
    return Point({**controller.parameters(), "vehicle.model": "CM", "vehicle.coupling": repr(kappa)}, over)


def _margin(limits: CouplingLimits) -> str:
    """Return in words how far the paper-like coupling is from the limit of the loop without notch."""
    unstable = np.array(growth_over(WITHOUT_NOTCH, PAPER_LIKE, list(limits.over))) >= 0.0
    said = f"the paper-like coupling, κ = {PAPER_LIKE:.2f},"
    if limits.nominal is None:
        return f"{said} is below the limit of the {WITHOUT_NOTCH.label}, which is stable at every coupling studied"
    share = PAPER_LIKE / limits.nominal - 1.0
    side = "below" if share < 0.0 else "above"
    return (
        f"{said} is {abs(100.0 * share):.1f} % {side} the limit of stability of the {WITHOUT_NOTCH.label}, κ = "
        f"{limits.nominal:.4f} (nominal vehicle); with the paper-like coupling, the linear loop without notch is "
        f"unstable at {unstable[1:].sum()} of the {len(limits.over) - 1} corners"
    )


STUDY = Study("coupling", "Inertial coupling", run)
