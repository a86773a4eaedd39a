"""Benefit and cost of the adjustable factor tau: the designs of section 4 over tau, flown until the loop is lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.control.design import ControlDesign
from hsv.design.adjustable import certified_loops, relaxed_bound
from hsv.design.baseline import design_gains, nominal_family, nominal_problem, with_family
from hsv.design.feedback import common_lyapunov
from hsv.design.inputs import DesignInputs, find_inputs, read_inputs, with_tau
from hsv.design.region import Region
from hsv.design.tube import MeasuredSet, measured_set
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.corners import fraction, region_parameters
from hsv.flight.metrics import flight_metrics
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import Corners, Feedback, stability_limit
from hsv_paper.plots import BLUE, DOTTED_GREY, GREEN, GREY, ORANGE, RED, ZERO, letter, new_figure
from hsv_paper.study import Outcome, Scope, in_words

FACTORS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Tube factors of the designs that are made and flown."""

FINE = np.linspace(0.25, 1.0, 76)
"""Tube factors of the linear loops."""

FEET, DEGREES = to_paper(1.0, "m/s")[0], to_paper(1.0, "rad")[0]


@dataclass(frozen=True)
class FactorRow:
    """One factor; SI.

    Attributes:
        tau: The factor.
        certified: One Lyapunov function is found for every factor between ``tau`` and 1.
        half_width: (5) of Z' for W'(tau); NaN where there is no set.
        half_width_complete: (5) of Z' for the full W; NaN where there is none or no input range is left.
        scaled: (5) half-width of the paper's tau Z.
        room: (2) range of the nominal input in U minus F' Z' about the target's trim, on the smaller side; below zero
            there is none, and K' keeps its bounds.
        input_bound: (2) of K'.
        settling: (2) times of altitude and velocity after a step, nominal vehicle.
        ramp: (2) integral absolute errors of altitude and velocity in Case 2.
        attitude: Deviation from nominal after the fault, nominal vehicle.
        worst_attitude: The same, worst of a quarter of the corners.
        worst_error: (2) altitude and velocity at the end, worst of these.
    """

    tau: float
    certified: bool
    half_width: np.ndarray
    half_width_complete: np.ndarray
    scaled: np.ndarray
    room: np.ndarray
    input_bound: np.ndarray
    settling: np.ndarray
    ramp: np.ndarray
    attitude: float
    worst_attitude: float
    worst_error: np.ndarray

    def report(self) -> dict[str, Any]:
        """Return the row for JSON."""
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(self).items()}


def run(scope: Scope) -> Outcome:
    """Design and fly at each factor, and find the factors at which the linear loops are stable and certified."""
    inputs = read_inputs(find_inputs("adjustable"))
    gains = replace(design_gains(inputs, scope.progress).design, filtered=True)
    rows = _rows(gains, inputs, FACTORS[:: scope.every], scope.progress)
    growths: dict[tuple[str, str], np.ndarray] = {}
    limits: dict[str, dict[str, float | None]] = {}
    for coupling in load_vehicle().couplings:
        limits[coupling] = {}
        for which, over in (("nominal", scope.over[:1]), ("worst", scope.over)):
            along = partial(growth, gains, coupling, over)
            growths[coupling, which] = np.array([along(tau) for tau in FINE.tolist()])
            limits[coupling][which] = stability_limit(along, FINE[::-1].tolist())
    least = min(tau for tau in FINE.tolist() if is_certified(gains, inputs, tau))
    figure = new_figure(7.2)
    panels = figure.subplots(3, 2).ravel()
    panels[0].axvspan(least, 1.0, color=GREEN, alpha=0.12, linewidth=0.0, label="one Lyapunov function")
    for coupling, color in zip(limits, (BLUE, RED), strict=True):
        label = f"{coupling.replace('_', '-')} coupling"
        panels[0].plot(FINE, growths[coupling, "nominal"], color=color, label=label)
        panels[0].plot(FINE, growths[coupling, "worst"], "--", color=color, linewidth=0.9)
    panels[0].axhline(0.0, **ZERO)
    panels[0].set_ylabel("largest real part (1/s)")
    _draw_rows(panels, rows)
    for panel in panels:
        panel.set_xlabel("τ")
        panel.set_xlim(1.02, FINE[0] if panel is panels[0] else rows[-1].tau - 0.02)
        panel.legend(loc="best")
    letter(panels)
    corners = in_words(scope.over)
    stable = "; ".join(
        f"with the {coupling.replace('_', '-')} coupling, the linear loop is stable {_stable(found['nominal'])} "
        f"(nominal vehicle) and {_stable(found['worst'])} (worst of {corners})"
        for coupling, found in limits.items()
    )
    return Outcome(
        figure,
        "The adjustable design is computed and flown for each factor. (a) Largest real part of the poles of the linear "
        "sampled loop around the coupled vehicle, including the notch filter, over both ends of the step, before and "
        f"after the fault: nominal vehicle (solid), and the worst of {corners} of the parameter bounds "
        "(dashed). Shaded: one Lyapunov function is found for the factor and all larger ones up to 1, over the "
        "vertices of the design's model, which does not include the coupling. (b) Half-width of the invariant set in "
        "velocity: Z' for the gain in use and W'(τ), the same for the full W, and the paper's τZ. (c) Range that "
        "remains for the nominal input about the target's trim, on the smaller side, relative to that at τ = 1 (eq. "
        "53). (d) Time until a step of +600 ft, +250 ft/s has settled to 2 % under K'(τ). (e) Case 2: integral of the "
        "error of altitude and velocity, nominal vehicle, relative to that at τ = 1. (f) Attitude deviation from "
        "nominal after the fault: nominal vehicle, and the worst of "
        f"{in_words(fraction(load_vehicle().uncertainty))}, a different selection.",
        (
            f"one Lyapunov function is found for every factor from τ = {least:.2f} to 1; {stable}",
            *(_finding(row, rows[0]) for row in rows),
            _verdict(rows),
        ),
        {"rows": [row.report() for row in rows], "stable_down_to": limits},
    )


def growth(gains: ControlDesign, coupling: str, over: Corners, tau: float) -> float:
    """Return the rightmost pole (1/s) of the loops with ``tau`` around the vehicles ``over``, the worst of all."""
    return Feedback.of(gains, tau).growth(load_vehicle().coupled(coupling), over)


def is_certified(gains: ControlDesign, inputs: DesignInputs, tau: float) -> bool:
    """Return whether one Lyapunov function is found for ``tau`` and everything up to 1, with the fault and without."""
    loops = certified_loops(_with(gains, tau), inputs.flown_vehicle, inputs.disturbance.elevator_effectiveness)
    try:
        common_lyapunov(loops, inputs.error_scale(), f"tau = {tau:g}")
    except DesignError:
        return False
    return True


def _rows(gains: ControlDesign, inputs: DesignInputs, factors: Sequence[float], progress: Progress) -> list[FactorRow]:
    """Design and fly at each of ``factors``, of which the first is 1."""
    one = _with(gains, 1.0)
    complete = measured_set(one, Region(one, inputs, 1.0), inputs, lambda *_: None)
    rows = []
    for done, tau in enumerate(factors):
        progress("factors", done, len(factors))
        rows.append(_row(gains, with_tau(inputs, [tau]), tau, complete))
    progress("factors", len(factors), len(factors))
    return rows


def _row(gains: ControlDesign, inputs: DesignInputs, tau: float, complete: MeasuredSet) -> FactorRow:
    unrelaxed = design = _with(gains, tau)
    incomplete = _measured(unrelaxed, inputs, tau)
    target = inputs.nominal.target
    trimmed = trim(load_vehicle().decoupled, target.altitude, target.velocity).input
    room = incomplete.bounds.symmetric(trimmed) if incomplete else np.full(2, np.nan)
    if incomplete and room.min() > 0.0:
        bound = relaxed_bound(inputs.nominal.input_bound.array(), trimmed, complete.bounds, incomplete.bounds)
        problem = nominal_problem(inputs, unrelaxed.polytope, bound)
        design = with_family(unrelaxed, problem, nominal_family(inputs, problem, lambda *_: None))
    step = inputs.model_copy(update={"disturbance": inputs.disturbance.model_copy(update={"ramp": None})})
    (stepped,) = _metrics(design, step, [{}])
    ramped = _metrics(design, inputs, Region(design, inputs, 1.0).fraction())
    axes, attitude = ("altitude", "velocity"), "post_fault_attitude_from_nominal"
    return FactorRow(
        tau=tau,
        certified=is_certified(gains, inputs, tau),
        half_width=_half_width(incomplete),
        half_width_complete=_half_width(_measured(design, inputs, 1.0)),
        scaled=tau * complete.found.half_width[:N_RIGID],
        room=room,
        input_bound=design.nominal_input_bound,
        settling=np.array([stepped.get(f"{axis}_settling_time", np.nan) for axis in axes]),
        ramp=np.array([ramped[0][f"{axis}_integral_absolute_error"] for axis in axes]),
        attitude=ramped[0][attitude],
        worst_attitude=max(metrics[attitude] for metrics in ramped),
        worst_error=np.array([max(abs(metrics[f"{axis}_end_error"]) for metrics in ramped) for axis in axes]),
    )


def _measured(design: ControlDesign, inputs: DesignInputs, share: float) -> MeasuredSet | None:
    try:
        return measured_set(design, Region(design, inputs, share), inputs, lambda *_: None)
    except DesignError:
        return None


def _half_width(found: MeasuredSet | None) -> np.ndarray:
    return found.found.half_width[:N_RIGID] if found else np.full(N_RIGID, np.nan)


def _with(gains: ControlDesign, tau: float) -> ControlDesign:
    factor = np.full(N_RIGID, tau)
    return replace(gains, tau=factor, tau_minimum=factor)


def _metrics(design: ControlDesign, inputs: DesignInputs, over: Corners) -> list[dict[str, float]]:
    parts = assemble({**design.to_parameters(), **region_parameters(inputs.model_dump(), inputs.flown_vehicle)})
    return [flight_metrics(fly(parts.perturbed(corner)).data()) for corner in over]


def _draw_rows(panels: np.ndarray, rows: list[FactorRow]) -> None:
    tau = [row.tau for row in rows]

    def line(panel: Axes, values: Any, color: str, label: str, style: str = "o-") -> None:
        panel.plot(tau, values, style, color=color, markersize=3, label=label)

    line(panels[1], [FEET * row.half_width[1] for row in rows], BLUE, "Z' for W'(τ)")
    line(panels[1], [FEET * row.half_width_complete[1] for row in rows], RED, "Z' for W")
    line(panels[1], [FEET * row.scaled[1] for row in rows], GREY, "τZ, the paper's")
    panels[1].set_ylabel("half-width in velocity (ft/s)")
    for column, name, color in ((0, "fuel equivalence ratio", ORANGE), (1, "elevator", BLUE)):
        line(panels[2], [row.room[column] / rows[0].room[column] for row in rows], color, name)
    panels[2].axhline(0.0, **ZERO)
    panels[2].set_ylabel("room of the nominal input,\nshare of that at τ = 1")
    for column, name, color in ((0, "altitude", GREEN), (1, "velocity", RED)):
        line(panels[3], [row.settling[column] for row in rows], color, name)
        line(panels[4], [row.ramp[column] / rows[0].ramp[column] for row in rows], color, name)
    panels[3].set_ylabel("step settled (s)")
    panels[4].set_ylabel("Case 2, error over time,\nshare of that at τ = 1")
    line(panels[5], [DEGREES * row.attitude for row in rows], BLUE, "nominal")
    line(panels[5], [DEGREES * row.worst_attitude for row in rows], RED, "worst", "o--")
    panels[5].axhline(0.5, **DOTTED_GREY)
    panels[5].set_ylabel("attitude after the fault (deg)")
    for index in (1, 3, 5):
        panels[index].set_ylim(bottom=0.0)


def _finding(row: FactorRow, first: FactorRow) -> str:
    room, share = row.room / first.room, row.ramp / first.ramp
    return (
        f"at τ = {row.tau:g}, the half-width in velocity is {FEET * row.half_width[1]:.1f} ft/s (Z') and "
        f"{FEET * row.scaled[1]:.1f} ft/s (τZ); the range of the nominal input (fuel and elevator) is {room[0]:.2f} "
        f"and {room[1]:.2f} times that at τ = 1; the step settles in {row.settling[0]:.1f} s (altitude) and "
        f"{row.settling[1]:.1f} s (velocity); the integral of the error in Case 2 is {share[0]:.2f} (altitude) and "
        f"{share[1]:.2f} (velocity) times that at τ = 1; the attitude deviation after the fault is "
        f"{DEGREES * row.attitude:.3f} deg (worst corner {DEGREES * row.worst_attitude:.3f} deg); the largest errors "
        f"at the end are {FEET * row.worst_error[0]:.1f} ft and {FEET * row.worst_error[1]:.1f} ft/s"
    )


def _verdict(rows: list[FactorRow]) -> str:
    """Return what the flights show of the paper's claim that a smaller factor is faster but less robust (4.3)."""
    first, last = rows[0], rows[-1]
    velocity = "settles sooner" if last.settling[1] < first.settling[1] else "does not settle sooner"
    tau = [row.tau for row in rows[1:] if row.settling[0] > first.settling[0]]
    altitude = f"settles later at τ = {', '.join(f'{t:g}' for t in tau)}" if tau else "does not settle later"
    ramp = "is followed more closely" if last.ramp[1] < first.ramp[1] else "is followed less closely"
    attitude = "moves less" if last.worst_attitude < first.worst_attitude else "moves more"
    size = "smaller" if last.half_width[1] < first.half_width[1] else "larger, whereas τZ is smaller"
    return (
        f"the paper claims that a smaller factor is faster but less robust. From τ = {first.tau:g} to {last.tau:g}, "
        f"the velocity {velocity} after a step, because K' may use more of the inputs; the altitude {altitude}; the "
        f"ramp, on which the nominal input is hardly used, {ramp}; after the fault the attitude {attitude}; and the "
        f"set of the gain in flight is {size}"
    )


def _stable(limit: float | None) -> str:
    if limit is None:
        return f"down to at least τ = {FINE[0]:g}"
    return "not even at τ = 1" if limit == 1.0 else f"down to τ = {limit:.2f}"
