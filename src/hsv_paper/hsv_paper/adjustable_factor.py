"""Benefits and costs of the adjustable tube factor tau: the designs of section 4 over tau, flown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.control.design import ControlDesign
from hsv.design.adjustable import certified_loops, relaxed_bound
from hsv.design.baseline import design_gains, nominal_family, nominal_problem, with_family
from hsv.design.inputs import DesignInputs, with_tau
from hsv.design.lyapunov import common_lyapunov
from hsv.design.region import Region, region_parameters
from hsv.design.tube import MeasuredSet, measured_set
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner
from hsv.flight.metrics import flight_metrics
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import stability_limit, worst_growth

FACTORS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Tube factors of the designs that are made and flown, unless fewer are requested."""

FINE = np.linspace(0.25, 1.0, 76)
"""Tube factors of the linear loops."""


@dataclass(frozen=True)
class FactorRow:
    """One factor; SI. ``certified``: one Lyapunov function for every factor between it and 1.

    ``half_width`` and ``half_width_complete`` (5): of Z' for W'(tau), and for the whole W; not a number: there is
    none, or nothing of an input is left. ``scaled`` (5): the paper's tau Z. ``room`` (2): of the nominal input in U
    minus F' Z' about the target's trim, on the side with less of it; below zero there is none, and K' keeps its bounds.
    ``input_bound`` (2): of K'. ``settling`` (2): altitude and velocity after a step, nominal vehicle. ``ramp`` (2):
    integral absolute errors of altitude and velocity in Case 2. ``attitude`` and ``worst_attitude``: after the fault,
    from nominal, at the nominal vehicle and the worst of a quarter of the corners; ``worst_error`` (2): altitude and
    velocity at the end there.
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


@dataclass(frozen=True)
class FactorStudy:
    """The rows of the study, the linear loops, and the certified ones.

    ``growth``: by coupling set, the rightmost pole (1/s) over :data:`FINE` of the nominal vehicle and of the worst,
    (2, f). ``limits``: by coupling set, the factor below which the loop is not stable, of the nominal vehicle and of
    the worst; ``None``: stable down to the least of :data:`FINE`. ``least_certified``: the least of :data:`FINE` with
    one Lyapunov function for it and everything up to 1.
    """

    rows: list[FactorRow]
    growth: dict[str, np.ndarray]
    limits: dict[str, tuple[float | None, float | None]]
    least_certified: float


def factor_study(
    inputs: DesignInputs, factors: Sequence[float], over: Sequence[Corner], progress: Progress
) -> FactorStudy:
    """Design and fly at each of ``factors``.

    Args:
        inputs: Inputs, such as those of the shipped adjustable design.
        factors: The first is 1.
        over: Vehicles of the linear loops, the nominal one first.
        progress: Called with what is done.

    Raises:
        DesignError: No design at tau = 1.
    """
    gains = replace(design_gains(inputs, progress).design, filtered=True)
    one = _with(gains, 1.0)
    complete = measured_set(one, Region(one, inputs, 1.0), inputs, lambda *_: None)
    rows = []
    for done, tau in enumerate(factors):
        progress("factors", done, len(factors))
        rows.append(_row(gains, with_tau(inputs, [tau]), tau, complete))
    progress("factors", len(factors), len(factors))
    growths, limits = {}, {}
    for coupling in load_vehicle().couplings:
        nominal, worst = (partial(growth, gains, coupling, vehicles) for vehicles in (over[:1], over))
        growths[coupling] = np.array([[loop(tau) for tau in FINE.tolist()] for loop in (nominal, worst)])
        limits[coupling] = (stability_limit(nominal, FINE[::-1].tolist()), stability_limit(worst, FINE[::-1].tolist()))
    certified = [tau for tau in FINE.tolist() if is_certified(gains, inputs, tau)]
    return FactorStudy(rows, growths, limits, min(certified))


def _row(gains: ControlDesign, inputs: DesignInputs, tau: float, complete: MeasuredSet) -> FactorRow:
    unrelaxed = _with(gains, tau)
    incomplete = _measured(unrelaxed, inputs, tau)
    target = inputs.nominal.target
    trimmed = trim(load_vehicle().decoupled, target.altitude, target.velocity).input
    given, design = inputs.nominal.input_bound.array(), unrelaxed
    room = incomplete.bounds.symmetric(trimmed) if incomplete else np.full(2, np.nan)
    if incomplete and room.min() > 0.0:
        bound = relaxed_bound(given, trimmed, complete.bounds, incomplete.bounds)
        problem = nominal_problem(inputs, unrelaxed.polytope, bound)
        design = with_family(unrelaxed, problem, nominal_family(inputs, problem, lambda *_: None))
    step = inputs.model_copy(update={"disturbance": inputs.disturbance.model_copy(update={"ramp": None})})
    stepped, ramped = _metrics(design, step, [{}])[0], _metrics(design, inputs, Region(design, inputs, 1.0).fraction())
    nominal = ramped[0]
    return FactorRow(
        tau=tau,
        certified=is_certified(gains, inputs, tau),
        half_width=_half_width(incomplete),
        half_width_complete=_half_width(_measured(design, inputs, 1.0)),
        scaled=tau * complete.found.half_width[:N_RIGID],
        room=room,
        input_bound=design.nominal_input_bound,
        settling=np.array([stepped.get(f"{axis}_settling_time", np.nan) for axis in ("altitude", "velocity")]),
        ramp=np.array([nominal[f"{axis}_integral_absolute_error"] for axis in ("altitude", "velocity")]),
        attitude=nominal["post_fault_attitude_from_nominal"],
        worst_attitude=max(m["post_fault_attitude_from_nominal"] for m in ramped),
        worst_error=np.array([max(abs(m[f"{axis}_end_error"]) for m in ramped) for axis in ("altitude", "velocity")]),
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


def _metrics(design: ControlDesign, inputs: DesignInputs, over: Sequence[Corner]) -> list[dict[str, float]]:
    parts = assemble({**design.to_parameters(), **region_parameters(inputs)})
    return [flight_metrics(fly(parts.perturbed(corner)).data()) for corner in over]


def growth(gains: ControlDesign, coupling: str, over: Sequence[Corner], tau: float) -> float:
    """Return the rightmost pole (1/s) of the loops with ``tau`` around the vehicles ``over``, the worst of all."""
    vehicle, gain = load_vehicle().coupled(coupling), tau * gains.feedback_gain
    return max(worst_growth(vehicle.perturbed(corner), gain, gains.notch, gains.period) for corner in over)


def is_certified(gains: ControlDesign, inputs: DesignInputs, tau: float) -> bool:
    """Return whether one Lyapunov function is found for ``tau`` and everything up to 1, with the fault and without."""
    loops = certified_loops(_with(gains, tau), inputs.flown_vehicle, inputs.disturbance.elevator_effectiveness)
    try:
        common_lyapunov(loops, inputs.error_scale(), f"tau = {tau:g}")
    except DesignError:
        return False
    return True
