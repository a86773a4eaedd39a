"""Benefit and cost of the adjustable factor tau: the paper's adjustable design and its flights, for several tau."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.certificate.coverage import region_parameters
from hsv.certificate.loops import Feedback
from hsv.control.design import ControlDesign
from hsv.design.adjustable import certified_loops, relaxed_bound
from hsv.design.baseline import design_gains, nominal_family, nominal_problem, with_family
from hsv.design.feedback import common_lyapunov
from hsv.design.inputs import DesignInputs, find_inputs, read_inputs, with_tau
from hsv.design.region import Region
from hsv.design.tube import MeasuredSet, measured_set
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.corners import fraction
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import Corners, largest_growth, stability_limit
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, RED, ZERO, new_figure
from hsv_paper.study import Outcome, Scope, rounded_cell, vehicles

FACTORS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Values of tau for which designs are made and flown."""

FINE = np.linspace(0.25, 1.0, 76)
"""Values of tau for which linear loops are computed."""

ATTITUDE = "post_fault_attitude_from_nominal"


def run(scope: Scope) -> Outcome:
    """Design and fly at each tau, and find the values at which the linear loops are stable and certified."""
    inputs = read_inputs(find_inputs("adjustable"))
    gains = replace(design_gains(inputs, scope.progress).design, filtered=True)
    least = min(tau for tau in FINE.tolist() if is_certified(gains, inputs, tau))
    rows = _rows(gains, inputs, scope)
    figure = new_figure(3.2)
    axis = figure.subplots()
    axis.axvspan(least, 1.0, color=GREEN, alpha=0.12, linewidth=0.0, label="one Lyapunov function")
    stable = []
    for coupling, color in zip(load_vehicle().couplings, (BLUE, RED), strict=True):
        label = f"{coupling.replace('_', '-')} coupling"
        limits: dict[str, float | None] = {}
        styles: tuple[dict[str, Any], ...] = {"label": label}, {"linestyle": "--", "linewidth": 0.9}
        for which, over, style in zip(
            ("nominal vehicle", "worst corner"), (scope.over[:1], scope.over), styles, strict=True
        ):
            along = partial(growth, gains, coupling, over)
            axis.plot(FINE, [along(tau) for tau in FINE.tolist()], color=color, **style)
            limits[which] = rounded_cell(stability_limit(along, FINE[::-1].tolist()), 2)
        stable.append({"linear loop": label, **limits})
    axis.axhline(0.0, **ZERO)
    axis.set(xlabel="τ", ylabel="largest real part (1/s)", xlim=(1.02, FINE[0]))
    axis.legend(loc="best")
    return Outcome(
        figure,
        f"Growth of the loop around the coupled vehicle, {vehicles(scope.over)}. Shaded: one Lyapunov function is "
        "found for the factor and all larger ones up to 1, over the vertices of the design's model, which does not "
        "include the coupling.",
        f"One Lyapunov function is found for every factor from τ = {least:.2f} to 1. The linear loop is stable down to "
        "these factors (1: not even there):",
        stable,
        "The adjustable design is computed and flown for each factor: the half-width of the invariant set Z' in "
        "velocity; the range that remains for the nominal input about the target's trim, on the "
        "smaller side, relative to that at τ = 1 (eq. 53); the time until a step of +600 ft, +250 ft/s has settled to "
        "2 % under K'(τ); in Case 2, the integral of the error of altitude and velocity, nominal vehicle, relative to "
        "that at τ = 1, and the attitude deviation from nominal after the fault, "
        f"{vehicles(fraction(load_vehicle().uncertainty))}, a different selection. The paper claims that a smaller "
        "factor is faster but less robust (4.3). After a step, K' may use more of the inputs; on the ramp, the nominal "
        "input is hardly used.",
        [{name: rounded_cell(value, _DIGITS.get(name, 2)) for name, value in row.items()} for row in rows],
    )


def growth(gains: ControlDesign, coupling: str, over: Corners, tau: float) -> float:
    """Return the largest growth (1/s) of the loops at ``tau`` around the vehicles ``over``."""
    return largest_growth(Feedback.of(gains, tau), load_vehicle().coupled(coupling), over)


def is_certified(gains: ControlDesign, inputs: DesignInputs, tau: float) -> bool:
    """Return whether one Lyapunov function is found for all factors from ``tau`` to 1, with and without the fault."""
    loops = certified_loops(_with(gains, tau), inputs.flown_vehicle, inputs.disturbance.elevator_effectiveness)
    try:
        common_lyapunov(loops, inputs.error_scale(), f"tau = {tau:g}")
    except DesignError:
        return False
    return True


def _rows(gains: ControlDesign, inputs: DesignInputs, scope: Scope) -> list[dict[str, float]]:
    """Return a table row for each tau, in the units of the page. Relative columns refer to the first row, tau = 1."""
    one = _with(gains, 1.0)
    complete = measured_set(one, Region(one, inputs, 1.0), inputs, lambda *_: None)
    target, factors = inputs.nominal.target, FACTORS[:: scope.every]
    trimmed = trim(load_vehicle().decoupled, target.altitude, target.velocity).input
    rows: list[dict[str, float]] = []
    first = np.ones(4)
    for done, tau in enumerate(factors):
        scope.progress("factors", done, len(factors))
        given, design = with_tau(inputs, [tau]), _with(gains, tau)
        incomplete = _measured(design, given, tau)
        room = incomplete.bounds.symmetric(trimmed) if incomplete else np.full(2, np.nan)
        if incomplete and room.min() > 0.0:
            bound = relaxed_bound(given.nominal.input_bound.array(), trimmed, complete.bounds, incomplete.bounds)
            problem = nominal_problem(given, design.polytope, bound)
            design = with_family(design, problem, nominal_family(given, problem, lambda *_: None))
        step = given.model_copy(update={"disturbance": given.disturbance.model_copy(update={"ramp": None})})
        (stepped,) = _metrics(design, step, [{}])
        ramped = _metrics(design, given, Region(design, given, 1.0).fraction())
        ramp = [ramped[0][f"{axis}_integral_absolute_error"] for axis in ("altitude", "velocity")]
        first = np.array([*room, *ramp]) if tau == 1.0 else first
        fuel, elevator, altitude, velocity = np.array([*room, *ramp]) / first
        rows.append(
            {
                "τ": tau,
                "Z' in V, ft/s": FEET * float(incomplete.found.half_width[1]) if incomplete else np.nan,
                "room, fuel": fuel,
                "elevator": elevator,
                "step settled: h, s": stepped.get("altitude_settling_time", np.nan),
                "V, s": stepped.get("velocity_settling_time", np.nan),
                "ramp error: h": altitude,
                "V": velocity,
                "attitude after fault, deg": DEGREES * ramped[0][ATTITUDE],
                "worst corner, deg": DEGREES * max(metrics[ATTITUDE] for metrics in ramped),
            }
        )
    scope.progress("factors", len(factors), len(factors))
    return rows


_DIGITS = dict.fromkeys(("Z' in V, ft/s", "step settled: h, s", "V, s"), 1)
_DIGITS |= {"attitude after fault, deg": 3, "worst corner, deg": 3}


def _measured(design: ControlDesign, inputs: DesignInputs, share: float) -> MeasuredSet | None:
    try:
        return measured_set(design, Region(design, inputs, share), inputs, lambda *_: None)
    except DesignError:
        return None


def _with(gains: ControlDesign, tau: float) -> ControlDesign:
    factor = np.full(N_RIGID, tau)
    return replace(gains, tau=factor, tau_minimum=factor)


def _metrics(design: ControlDesign, inputs: DesignInputs, over: Corners) -> list[dict[str, float]]:
    parts = assemble({**design.to_parameters(), **region_parameters(inputs.model_dump(), inputs.flown_vehicle)})
    return [fly(parts.perturbed(corner)).metrics for corner in over]
