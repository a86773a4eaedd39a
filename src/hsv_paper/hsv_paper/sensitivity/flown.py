"""Sweeps of flights: coupling, sampling period, size of the uncertainty, depth of the fault, length of the ramp."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsv.base.errors import ScenarioError
from hsv.base.units import to_paper
from hsv.control.design import ControlDesign, find_design, read_design, read_parameters, write_design
from hsv.design.baseline import design_gains
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.scenario import load_scenario
from hsv.flight.sources import DIGITS, code_digest, digest_of, package_digest
from hsv.flight.tables import CommandTable
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Point, kept
from hsv_paper.linear_loop import COUPLING_SCALES, Corners, Feedback
from hsv_paper.plots import BLUE, DOTTED_GREY, GREEN, GREY, ORANGE, RED, ZERO, letter, new_figure, plain_log
from hsv_paper.sensitivity.sweep import (
    ALL,
    LOSSES,
    RMPC_DECOUPLED,
    RMPC_GAIN,
    SATURATED,
    WITHOUT_NOTCH,
    Columns,
    Controller,
    CouplingLimits,
    draw_losses,
    draw_metric,
    feedback,
    labelled,
    legend,
    lost_where,
    of_scenarios,
    sweep,
    widths,
)
from hsv_paper.study import Outcome, Scope, in_words

FLOWN = (*ALL, RMPC_DECOUPLED)

PAPER_LIKE = load_vehicle().coupling_scale("paper_like")
"""kappa of the paper-like set."""

RAMPED = (
    Controller("baseline", "case2_baseline", ORANGE),
    Controller("adjustable, tau = 1", "case2_tau1", GREEN, "adjustable"),
    Controller("adjustable, tau = 0.8", "case2", BLUE, "adjustable"),
)

PERIODS = {
    period: Controller(f"T = {period:g} s", "case1", color)
    for period, color in ((0.01, GREEN), (0.02, BLUE), (0.05, RED))
}
"""Controllers by sampling period (s)."""

INTEGRATION_STEP = 0.01
"""s: of the vehicle, as at the shipped period."""

FEET, DEGREES = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]


def coupling(scope: Scope) -> Outcome:
    """Fly and linearise every controller over the coupling, beginning at kappa = 0, the decoupled model."""
    kappas = scope.grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05)

    def point(controller: Controller, kappa: float) -> Point:
        return Point({**controller.parameters(), "vehicle.model": "CM", "vehicle.coupling": repr(kappa)}, scope.over)

    results = sweep(scope, "coupling", {c: [point(c, kappa) for kappa in kappas.tolist()] for c in ALL})
    loops = {c.label: feedback(c) for c in ALL}
    growths, limits = _over_coupling(scope, "coupling, linear loops", loops, kappas)
    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    for controller, width in zip(ALL, widths(len(ALL)), strict=True):
        values, style = growths[controller.label], {"color": controller.color, "linewidth": width}
        axes[0].plot(kappas, values[:, 0], label=controller.label, **style)
        axes[0].plot(kappas, values.max(axis=1), "--", **style)
    axes[0].axhline(0.0, **ZERO)
    axes[0].set(ylim=(-0.5, 1.5), ylabel="largest real part (1/s)")
    draw_metric(axes[1], kappas, results, "elastic_decay_time", "elastic decay (s)")
    draw_metric(axes[2], kappas, results, "post_fault_attitude_deviation", "attitude excursion (deg)")
    plain_log(axes[2])
    axes[2].set_xlabel(r"coupling $\kappa$ (0: decoupled, 1: derived from a beam model)")
    for axis in axes:
        for kappa in (PAPER_LIKE, 1.0):
            axis.axvline(kappa, **DOTTED_GREY)
    axes[0].text(PAPER_LIKE + 0.005, 1.32, "paper-like", color=GREY, fontsize=8)
    axes[0].text(0.995, 1.32, "derived", color=GREY, fontsize=8, ha="right")
    letter(axes)
    legend(figure, shares=False)
    found = [f"{c.label}: {limits[c.label].in_words()}; {lost_where(kappas, results[c], 'κ = {}')}" for c in ALL]
    return Outcome(
        figure,
        f"Case 1 on the coupled model, with the nominal vehicle (solid) and the worst of {in_words(scope.over)} of the "
        "parameter bounds (dashed). (a) Largest real part of the poles of the linear sampled loop, over both ends of "
        "the step, before and after the fault; the limits of stability below are found by root finding. (b), (c) "
        "Flights; a line ends where a flight is lost, and a decay time of 100 s means that the rates have not decayed "
        f"by the end of the flight. {SATURATED} {RMPC_GAIN}; with κ = 0 and without notch, it is the controller of the "
        "paper, which flies it on the decoupled model only.",
        (*found, _paper_like_margin(limits[WITHOUT_NOTCH.label])),
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {label: rows.tolist() for label, rows in growths.items()},
            "unstable_from": {label: found.report() for label, found in limits.items()},
            "flights": labelled(results),
        },
    )


def sampling(scope: Scope) -> Outcome:
    """Design at each period, linearise over the coupling with and without notch, and fly Case 1."""
    kappas = scope.grid(COUPLING_SCALES[0], COUPLING_SCALES[-1], 0.05)
    designs = {period: _design_at(period, scope) for period in PERIODS}
    loops = {
        f"{period:g} s, {name}": Feedback.of(design, notched=name != "without")
        for period, design in designs.items()
        for name in ("with the notch", "without")
    }
    growths, limits = _over_coupling(scope, "sampling, linear loops", loops, kappas)

    def point(design: ControlDesign) -> Point:
        # The integration keeps its step, whatever the control period.
        substeps = max(1, round(design.period / INTEGRATION_STEP))
        values = {**design.to_parameters(), **load_scenario("case1").parameters(), "substeps": substeps}
        return Point(values, scope.over)

    results = sweep(scope, "sampling", {PERIODS[period]: [point(design)] for period, design in designs.items()})
    figure = new_figure(5.6)
    axes = figure.subplots(2, 1, sharex=True)
    for axis, name in zip(axes, ("with the notch", "without"), strict=True):
        for period, controller in PERIODS.items():
            values, label = growths[f"{period:g} s, {name}"], f"${controller.label}$".replace(" s$", "$ s")
            axis.plot(kappas, values[:, 0], color=controller.color, label=label)
            axis.plot(kappas, values.max(axis=1), "--", color=controller.color, linewidth=0.9)
        axis.axhline(0.0, **ZERO)
        axis.set_ylabel("largest real part (1/s)")
        axis.set_title(name, loc="right")
        for kappa in (PAPER_LIKE, 1.0):
            axis.axvline(kappa, **DOTTED_GREY)
    axes[1].set_xlabel(rf"coupling $\kappa$ ({PAPER_LIKE:g}: paper-like, 1: derived)")
    axes[0].legend(loc="upper left")
    letter(axes)

    def flown(columns: Columns) -> str:
        attitude, worst_attitude = (
            DEGREES * columns[f"post_fault_attitude_deviation_{which}"][0] for which in ("nominal", "worst")
        )
        decay, worst_decay = (columns[f"elastic_decay_time_{which}"][0] for which in ("nominal", "worst"))
        lost = 1.0 - columns["finished"][0]
        return (
            f"in Case 1 with the paper-like coupling and the notch, the attitude excursion is {attitude:.3f} deg "
            f"(worst corner {worst_attitude:.3f} deg), the decay time is {decay:.1f} s (worst corner {worst_decay:.1f} "
            f"s), and {f'{100.0 * lost:.0f} % of the flights are lost' if lost else 'no flight is lost'}"
        )

    return Outcome(
        figure,
        "At each period, the polytopic model, F and K are designed from the baseline's inputs, and its notch is "
        "discretised at that period. The panels show the largest real part of the poles of the sampled loop over the "
        "coupling, over both ends of the step, before and after the fault: nominal vehicle (solid) and the worst of "
        f"{in_words(scope.over)} of the parameter bounds (dashed). The limits of stability below are found by root "
        "finding.",
        [
            f"{controller.label}: with the notch, {limits[f'{period:g} s, with the notch'].in_words()}; without it, "
            f"{limits[f'{period:g} s, without'].in_words()}; {flown(results[controller])}"
            for period, controller in PERIODS.items()
        ],
        {
            "kappa": kappas.tolist(),
            "growth_per_s": {label: rows.tolist() for label, rows in growths.items()},
            "unstable_from": {label: found.report() for label, found in limits.items()},
            "flights": labelled(results),
        },
    )


def parameters(scope: Scope) -> Outcome:
    """Fly every controller with 0 to 6 times the paper's parameter bounds."""
    scales = scope.grid(0.0, 6.0, 0.25)
    over = [scope.corners(scale) for scale in scales.tolist()]
    results = sweep(scope, "parameters", {c: [Point(c.parameters(), corners) for corners in over] for c in FLOWN})
    figure = new_figure(7.2)
    label = "parameter scale (1: the paper's bounds, mass and moment of inertia 10 %)"
    for axis in draw_losses(figure, scales, {c: results[c] for c in ALL}, label):
        axis.axvline(1.0, **DOTTED_GREY)
    return Outcome(
        figure,
        "Case 1 on the coupled model with the paper-like coupling, flown with the nominal vehicle and "
        f"{in_words(over[0])} of the scaled bounds. {LOSSES} {RMPC_GAIN}.",
        [f"{c.label}: {lost_where(scales, rows, '{} times the bounds', nominal=False)}" for c, rows in results.items()],
        {"scale": scales.tolist(), "flights": labelled(results)},
    )


def others_with_elevator_fault(scenarios: Sequence[str]) -> list[Controller]:
    """Return the controllers of further scenarios.

    Raises:
        ScenarioError: A scenario is invalid, or does not have exactly one fault, of the elevator.
    """
    others = of_scenarios(scenarios)
    for controller in others:
        if (channels := controller.parameters().get("fault.channels", [])) != ["elevator_deflection"]:
            raise ScenarioError(
                f"scenario {controller.scenario!r}: fault: of {', '.join(channels) or 'nothing'}, expected one, of "
                "elevator_deflection"
            )
    return others


def fault(scope: Scope) -> Outcome:
    """Fly every controller, and those of further scenarios, with an elevator effectiveness from 1 down to 0.3."""
    others = others_with_elevator_fault(scope.additional)
    shares = scope.grid(0.3, 1.0, 0.025)

    def point(controller: Controller, left: float) -> Point:
        return Point(controller.parameters() | {"fault.parameters": [f"effectiveness={left!r}"]}, scope.over)

    along = {c: [point(c, left) for left in shares.tolist()] for c in (*FLOWN, *others)}
    results = sweep(scope, "fault", along)
    figure = new_figure(7.2)
    label = "elevator effectiveness after the fault (0.9: the paper's)"
    axes = draw_losses(figure, shares, {c: results[c] for c in (*ALL, *others)}, label)
    # Without a fault the excursions are tiny, and that end of the curves would take most of the axis.
    axes[1].set_ylim(bottom=0.05)
    axes[2].set_ylim(bottom=1.0)
    for axis in axes:
        axis.axvline(0.9, **DOTTED_GREY)
        axis.set_xlim(1.0, 0.3)
    return Outcome(
        figure,
        "Case 1 on the coupled model with the paper-like coupling, flown with the nominal vehicle and "
        f"{in_words(scope.over)} of the parameter bounds. {LOSSES} {RMPC_GAIN}.",
        [
            f"{c.label}: {lost_where(shares, columns, 'effectiveness {}', digits=3, rising=False)}"
            for c, columns in results.items()
        ],
        {"effectiveness": shares.tolist(), "flights": labelled(results)},
    )


def ramp(scope: Scope) -> Outcome:
    """Fly Case 2 with ramps of 15 s to 80 s; the last ends when the fault occurs."""
    lengths = scope.grid(15.0, 80.0, 5.0)

    def command(controller: Controller) -> CommandTable:
        (found,) = load_scenario(controller.scenario).command
        return found

    def point(controller: Controller, length: float) -> Point:
        changed = command(controller).model_copy(update={"end": command(controller).start + length})
        scenario = load_scenario(controller.scenario).model_copy(update={"command": (changed,)})
        return Point({**read_parameters(find_design(controller.design)), **scenario.parameters()}, scope.over)

    results = sweep(scope, "ramp", {c: [point(c, length) for length in lengths.tolist()] for c in RAMPED})
    shipped = command(RAMPED[0])
    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    draw_metric(axes[0], lengths, results, "altitude_error_maximum", "largest altitude error (ft)")
    draw_metric(axes[1], lengths, results, "velocity_error_maximum", "largest velocity error (ft/s)")
    draw_metric(axes[2], lengths, results, "post_fault_attitude_from_nominal", "attitude from nominal (deg)")
    axes[2].axhline(0.5, **ZERO)
    for axis in axes:
        axis.axvline(shipped.end - shipped.start, **DOTTED_GREY)
    for controller in RAMPED:
        axes[0].plot([], [], color=controller.color, label=controller.label)
    axes[2].set_xlabel(f"length of the ramp (s); {shipped.end - shipped.start:g} s: the shipped scenarios")
    letter(axes)
    legend(figure, shares=False)

    def errors(columns: Columns, index: int, which: str) -> str:
        altitude, velocity = (columns[f"{axis}_error_maximum_{which}"][index] for axis in ("altitude", "velocity"))
        return f"{FEET * altitude:.0f} ft and {FEET * velocity:.1f} ft/s"

    def finding(columns: Columns) -> str:
        ends = "; ".join(
            f"with a ramp of {lengths[i]:g} s, the largest errors are {errors(columns, i, 'nominal')} (nominal "
            f"vehicle) and {errors(columns, i, 'worst')} (worst corner)"
            for i in (0, -1)
        )
        attitude = DEGREES * np.array(columns["post_fault_attitude_from_nominal_worst"])
        limited = lengths[np.array(columns["without_limits"]) < 1.0]
        met = (
            f"flights are saturated with ramps up to {limited.max():g} s" if len(limited) else "no flight is saturated"
        )
        return (
            f"{ends}; the worst attitude deviation from nominal after the fault is {attitude.min():.3f} to "
            f"{attitude.max():.3f} deg; {met}"
        )

    return Outcome(
        figure,
        f"Case 2 with a ramp that starts at {shipped.start:g} s; nominal vehicle (solid) and the worst of "
        f"{in_words(scope.over)} of the parameter bounds (dashed). The ramp of {lengths[-1]:g} s ends when the fault "
        "occurs, so that its largest error includes the effect of the fault. (c) Attitude deviation from nominal "
        f"after the fault; the black line is half a degree. {SATURATED}",
        [f"{controller.label}: {finding(columns)}" for controller, columns in results.items()],
        {"length_s": lengths.tolist(), "flights": labelled(results)},
    )


def _over_coupling(
    scope: Scope, what: str, loops: dict[str, Feedback], kappas: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, CouplingLimits]]:
    """Return by loop the growth (kappas, vehicles), 1/s, and the limits of stability."""
    growths, limits = {}, {}
    for done, (label, loop) in enumerate(loops.items()):
        scope.progress(what, done, len(loops))
        growths[label] = np.array([growth_over(loop, kappa, scope.over) for kappa in kappas.tolist()])
        limits[label] = CouplingLimits.of(loop, scope.over)
    scope.progress(what, len(loops), len(loops))
    return growths, limits


def growth_over(loop: Feedback, kappa: float, over: Corners) -> list[float]:
    """Return the growth (1/s) of a loop around each vehicle of ``over`` with ``kappa`` times the derived coupling."""
    vehicle = load_vehicle().coupled(kappa)
    return [loop.growth(vehicle, [corner]) for corner in over]


def _paper_like_margin(limits: CouplingLimits) -> str:
    """Return in words how far the paper-like coupling is from the limit of the loop without notch."""
    paper_like = f"the paper-like coupling, κ = {PAPER_LIKE:.2f},"
    if limits.nominal is None:
        return (
            f"{paper_like} is below the limit of the {WITHOUT_NOTCH.label}, which is stable at every coupling studied"
        )
    unstable = np.array(growth_over(feedback(WITHOUT_NOTCH), PAPER_LIKE, limits.over)) >= 0.0
    share = PAPER_LIKE / limits.nominal - 1.0
    return (
        f"{paper_like} is {abs(100.0 * share):.1f} % {'below' if share < 0.0 else 'above'} the limit of stability of "
        f"the {WITHOUT_NOTCH.label}, κ = {limits.nominal:.4f} (nominal vehicle); with the paper-like coupling, the "
        f"linear loop without notch is unstable at {unstable[1:].sum()} of the {len(limits.over) - 1} corners"
    )


def _design_at(period: float, scope: Scope) -> ControlDesign:
    """Return the gains of the baseline's inputs at ``period`` (s), designed once and kept."""
    source = find_inputs("baseline")
    inputs = read_inputs(source)
    if period == inputs.model.period:
        return read_design(find_design("baseline"))
    parts = source.read_text(encoding="utf-8"), code_digest(), package_digest("design"), str(period)
    digest = digest_of(part.encode() for part in parts)
    path = scope.folder / f"design_{1e3 * period:.0f}ms_{digest[:DIGITS]}.yaml"

    def made() -> ControlDesign:
        changed = inputs.model_copy(update={"model": inputs.model.model_copy(update={"period": period})})
        return design_gains(
            changed, lambda what, done, of: scope.progress(f"design at {period:g} s: {what}", done, of)
        ).design

    comment = f"The baseline's gains at a period of {period:g} s, for hsv-paper sensitivity sampling."
    return kept(path, made, lambda new, design: write_design(new, design, comment), read_design)
