"""Studies by flights: coupling, size of the uncertainty, depth of the fault."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.certificate.loops import Feedback
from hsv.model.vehicle import load_vehicle
from hsv_paper import plots
from hsv_paper.flights import Point
from hsv_paper.linear_loop import COUPLING_SCALES, Corners, critical_coupling, growths
from hsv_paper.sensitivity.sweep import (
    ALL,
    LOSSES,
    RMPC_DECOUPLED,
    Controller,
    draw_losses,
    draw_metric,
    legend,
    lost_where,
    sweep,
    widths,
)
from hsv_paper.study import Outcome, Scope, vehicles

FLOWN = (*ALL, RMPC_DECOUPLED)

PAPER_LIKE = load_vehicle().coupling_scale("paper_like")
"""Multiple kappa of the derived coupling that is the paper-like coupling."""


def coupling(scope: Scope) -> Outcome:
    """Fly every controller and compute its linear loop, for couplings kappa from 0, the decoupled model, upwards."""
    kappas = scope.grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05)

    def point(controller: Controller, kappa: float) -> Point:
        return Point({**controller.parameters(), "vehicle.model": "CM", "vehicle.coupling": repr(kappa)}, scope.over)

    results = sweep(scope, ALL, kappas.tolist(), point)
    figure = plots.new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    for done, (controller, width) in enumerate(zip(ALL, widths(len(ALL)), strict=True)):
        scope.progress("coupling, linear loops", done, len(ALL))
        style = {"label": controller.label, "color": controller.color}
        draw_growth(axes[0], kappas, controller.loop, scope.over, (width, width), **style)
    axes[0].set(ylim=(-0.5, 1.5))
    draw_metric(axes[1], kappas, results, "elastic_decay_time", "elastic decay (s)")
    draw_metric(axes[2], kappas, results, "post_fault_attitude_deviation", "attitude excursion (deg)")
    plots.plain_log(axes[2])
    axes[2].set_xlabel(r"coupling $\kappa$ (0: decoupled, 1: derived from a beam model)")
    mark_couplings(axes, axes[:1])
    axes[0].text(PAPER_LIKE + 0.005, 1.32, "paper-like", color=plots.GREY, fontsize=8)
    axes[0].text(0.995, 1.32, "derived", color=plots.GREY, fontsize=8, ha="right")
    plots.letter(axes)
    legend(figure, shares=False)
    return Outcome(
        figure,
        f"Case 1 on the coupled model, {vehicles(scope.over)}. (a) Growth of the linear loops. (b), (c) Flights; a "
        "curve ends where the rates have not decayed by the end of the flight. With κ = 0 and without "
        "notch, RMPC is the controller of the paper, which flies it on the decoupled model only. The paper-like "
        f"coupling is κ = {PAPER_LIKE:.2f}.",
        [
            {"controller": c.label, **coupling_limits(c.loop, scope.over), **lost_where(kappas, columns)}
            for c, columns in results.items()
        ],
    )


def parameters(scope: Scope) -> Outcome:
    """Fly every controller with 0 to 6 times the paper's bounds on the parameters."""
    scales = scope.grid(0.0, 6.0, 0.25)
    results = sweep(scope, FLOWN, scales.tolist(), lambda c, scale: Point(c.parameters(), scope.corners(scale)))
    figure = plots.new_figure(7.2)
    label = "parameter scale (1: the paper's bounds, mass and moment of inertia 10 %)"
    for axis in draw_losses(figure, scales, {c: results[c] for c in ALL}, label):
        axis.axvline(1.0, **plots.DOTTED_GREY)
    return Outcome(
        figure,
        f"Case 1 on the coupled model with the paper-like coupling, {vehicles(scope.over)} of the scaled bounds. "
        f"{LOSSES}",
        "In multiples of the bounds:",
        [{"controller": c.label, **lost_where(scales, columns)} for c, columns in results.items()],
    )


def fault(scope: Scope) -> Outcome:
    """Fly every controller with an elevator effectiveness from 1 down to 0.3 after the fault."""
    shares = scope.grid(0.3, 1.0, 0.025)

    def point(controller: Controller, left: float) -> Point:
        return Point(controller.parameters() | {"fault.parameters": [f"effectiveness={left!r}"]}, scope.over)

    results = sweep(scope, FLOWN, shares.tolist(), point)
    figure = plots.new_figure(7.2)
    label = "elevator effectiveness after the fault (0.9: the paper's)"
    axes = draw_losses(figure, shares, {c: results[c] for c in ALL}, label)
    # Without a fault the excursions are tiny; on the logarithmic axes they would take most of the height.
    axes[1].set_ylim(bottom=0.05)
    axes[2].set_ylim(bottom=1.0)
    for axis in axes:
        axis.axvline(0.9, **plots.DOTTED_GREY)
        axis.set_xlim(1.0, 0.3)
    return Outcome(
        figure,
        f"Case 1 on the coupled model with the paper-like coupling, {vehicles(scope.over)}. {LOSSES}",
        "By effectiveness, from 1 down:",
        [{"controller": c.label, **lost_where(shares, found, 3, rising=False)} for c, found in results.items()],
    )


def draw_growth(
    axis: Axes, kappas: np.ndarray, loop: Feedback, over: Corners, widths: tuple[float, float], **style: Any
) -> None:
    """Draw the growth of a loop over the coupling: solid for the nominal vehicle, first of ``over``, dashed: worst."""
    values = np.array([growths(loop, load_vehicle().coupled(kappa), over) for kappa in kappas.tolist()])
    axis.plot(kappas, values[:, 0], linewidth=widths[0], **style)
    axis.plot(kappas, values.max(axis=1), "--", linewidth=widths[1], color=style["color"])
    axis.set_ylabel("largest real part (1/s)")


def mark_couplings(axes: Sequence[Axes], growths: Sequence[Axes]) -> None:
    """Mark the paper-like and the derived coupling in all panels, and the limit of stability in ``growths``."""
    for axis in growths:
        axis.axhline(0.0, **plots.ZERO)
    for axis in axes:
        for kappa in (PAPER_LIKE, 1.0):
            axis.axvline(kappa, **plots.DOTTED_GREY)


def coupling_limits(loop: Feedback, over: Corners) -> dict[str, str]:
    """Return table cells with the kappa up to which the linear loop is stable: nominal vehicle, worst of ``over``."""
    limits = {"nominal": critical_coupling(loop), "worst": critical_coupling(loop, over)}
    beyond = f"≥ {COUPLING_SCALES[-1]:g}"
    return {f"stable up to κ, {which}": beyond if k is None else f"{k:.2f}" for which, k in limits.items()}
