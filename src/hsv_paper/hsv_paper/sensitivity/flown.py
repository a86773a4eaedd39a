"""Studies by flights: coupling, sampling period, size of the uncertainty, depth of the fault, length of the ramp."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.certificate.loops import Feedback
from hsv.control.design import ControlDesign
from hsv.control.design_file import find_design, read_design, read_parameters
from hsv.design.baseline import design_gains
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.scenario import load_scenario
from hsv.flight.tables import CommandTable
from hsv.model.vehicle import load_vehicle
from hsv_paper import plots
from hsv_paper.flights import Point
from hsv_paper.linear_loop import COUPLING_SCALES, Corners, critical_coupling, growths
from hsv_paper.sensitivity.sweep import (
    ALL,
    LOSSES,
    RMPC_DECOUPLED,
    Columns,
    Controller,
    draw_losses,
    draw_metric,
    legend,
    lost_where,
    sweep,
    widths,
)
from hsv_paper.study import Outcome, Scope, in_words, rounded

FLOWN = (*ALL, RMPC_DECOUPLED)

PAPER_LIKE = load_vehicle().coupling_scale("paper_like")
"""Multiple kappa of the derived coupling that is the paper-like coupling."""

RAMPED = (
    Controller("baseline", "case2_baseline", plots.ORANGE),
    Controller("adjustable, tau = 1", "case2_tau1", plots.GREEN, "adjustable"),
    Controller("adjustable, tau = 0.8", "case2", plots.BLUE, "adjustable"),
)

PERIODS = {
    period: Controller(f"T = {period:g} s", "case1", color)
    for period, color in ((0.01, plots.GREEN), (0.02, plots.BLUE), (0.05, plots.RED))
}
"""Controllers by sampling period (s), for the labels and colours of curves."""

INTEGRATION_STEP = 0.01
"""Integration step (s) of the vehicle, as in the shipped scenarios."""


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
        f"Case 1 on the coupled model, {in_words(scope.over)}. (a) Growth of the linear loops. (b), (c) Flights; a "
        "decay time of 100 s means that the rates have not decayed by the end of the flight. With κ = 0 and without "
        "notch, RMPC is the controller of the paper, which flies it on the decoupled model only. The paper-like "
        f"coupling is κ = {PAPER_LIKE:.2f}.",
        [
            {"controller": c.label, **coupling_limits(c.loop, scope.over), **lost_where(kappas, columns)}
            for c, columns in results.items()
        ],
    )


def sampling(scope: Scope) -> Outcome:
    """Design the baseline at each sampling period; compute its loop's growth (1/s) over the coupling; fly Case 1."""
    kappas = scope.grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05)
    designs = {period: _design_at(period, scope) for period in PERIODS}

    def point(controller: Controller, period: float) -> Point:
        # The integration step stays the same at every sampling period.
        substeps = max(1, round(period / INTEGRATION_STEP))
        values = {**designs[period].to_parameters(), **load_scenario("case1").parameters(), "substeps": substeps}
        return Point(values, scope.over)

    figure = plots.new_figure(5.6)
    axes = figure.subplots(2, 1, sharex=True)
    rows = []
    for period, controller in PERIODS.items():
        scope.progress(f"{period:g} s, linear loops", 0, 1)
        row: dict[str, Any] = {"period": f"{period:g} s"}
        for axis, name in zip(axes, ("with the notch", "without"), strict=True):
            loop = Feedback.of(designs[period], notched=name != "without")
            style = {"label": f"${controller.label}$".replace(" s$", "$ s"), "color": controller.color}
            draw_growth(axis, kappas, loop, scope.over, (1.0, 0.9), **style)
            row |= {f"{name}: {what}": limit for what, limit in coupling_limits(loop, scope.over).items()}
        columns = sweep(scope, [controller], [period], point)[controller]
        for which in ("nominal", "worst"):
            excursion = plots.DEGREES * columns[f"post_fault_attitude_deviation_{which}"][0]
            row[f"attitude excursion, deg, {which}"] = rounded(excursion, 3)
        rows.append(row | {"lost, %": rounded(100.0 * (1.0 - columns["finished"][0]))})
    for axis, name in zip(axes, ("with the notch", "without"), strict=True):
        axis.set_title(name, loc="right")
    mark_couplings(axes, axes)
    axes[1].set_xlabel(rf"coupling $\kappa$ ({PAPER_LIKE:g}: paper-like, 1: derived)")
    axes[0].legend(loc="upper left")
    plots.letter(axes)
    return Outcome(
        figure,
        "At each period, the polytopic model, F and K are designed from the baseline's inputs, and its notch is "
        f"discretised at that period. The panels show the growth over the coupling, {in_words(scope.over)}. The "
        "flights are those of Case 1 with the paper-like coupling and the notch.",
        rows,
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
        f"Case 1 on the coupled model with the paper-like coupling, {in_words(scope.over)} of the scaled bounds. "
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
        f"Case 1 on the coupled model with the paper-like coupling, {in_words(scope.over)}. {LOSSES}",
        "By effectiveness, from 1 down:",
        [{"controller": c.label, **lost_where(shares, found, 3, rising=False)} for c, found in results.items()],
    )


def ramp(scope: Scope) -> Outcome:
    """Fly Case 2 with ramps of 15 s to 80 s; the longest ends when the fault occurs."""
    lengths = scope.grid(15.0, 80.0, 5.0)

    def command(controller: Controller) -> CommandTable:
        (found,) = load_scenario(controller.scenario).command
        return found

    def point(controller: Controller, length: float) -> Point:
        changed = command(controller).model_copy(update={"end": command(controller).start + length})
        scenario = load_scenario(controller.scenario).model_copy(update={"command": (changed,)})
        return Point({**read_parameters(find_design(controller.design)), **scenario.parameters()}, scope.over)

    results = sweep(scope, RAMPED, lengths.tolist(), point)
    shipped = command(RAMPED[0])
    figure = plots.new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_metric(axes[0], lengths, results, "altitude_error_maximum", "largest altitude error (ft)")
    draw_metric(axes[1], lengths, results, "velocity_error_maximum", "largest velocity error (ft/s)")
    draw_metric(axes[2], lengths, results, "post_fault_attitude_from_nominal", "attitude from nominal (deg)")
    axes[2].axhline(0.5, **plots.ZERO)
    for axis in axes:
        axis.axvline(shipped.end - shipped.start, **plots.DOTTED_GREY)
    for controller in RAMPED:
        axes[0].plot([], [], color=controller.color, label=controller.label)
    axes[2].set_xlabel(f"length of the ramp (s); {shipped.end - shipped.start:g} s: the shipped scenarios")
    plots.letter(axes)
    legend(figure, shares=False)

    def row(controller: Controller, columns: Columns, index: int) -> dict[str, Any]:
        errors = {
            f"largest error in {name}, {which}": rounded(plots.FEET * columns[f"{metric}_{which}"][index], digits)
            for name, metric, digits in (
                ("h, ft", "altitude_error_maximum", 0),
                ("V, ft/s", "velocity_error_maximum", 1),
            )
            for which in ("nominal", "worst")
        }
        return {"controller": controller.label, "ramp, s": rounded(lengths[index]), **errors}

    return Outcome(
        figure,
        f"Case 2 with a ramp that starts at {shipped.start:g} s, {in_words(scope.over)}. The ramp of {lengths[-1]:g} s "
        "ends when the fault occurs, so that its largest error includes the effect of the fault. (c) Attitude "
        "deviation from nominal after the fault; the black line is half a degree.",
        [row(controller, columns, index) for controller, columns in results.items() for index in (0, -1)],
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


def _design_at(period: float, scope: Scope) -> ControlDesign:
    """Return the baseline designed for a ``period`` (s): the shipped design, or new gains from the same inputs."""
    inputs = read_inputs(find_inputs("baseline"))
    if period == inputs.model.period:
        return read_design(find_design("baseline"))
    changed = inputs.model_copy(update={"model": inputs.model.model_copy(update={"period": period})})
    return design_gains(changed, lambda what, *done: scope.progress(f"{what} at {period:g} s", *done)).design
