"""The adjustable design (paper section 4, Algorithm 1): notch filter in the model, factor tau on the feedback.

    u = tau F' (x' - x_n' - x_r') + K' x_n' + u_r,   0 < tau <= 1                                             (48), (54)

Primes denote the co-designed model, which includes the notch filter. The steps are the model (45), the gain F'
(24), the disturbance set W' (47), the invariant set Z' for all factors from tau to 1 (25)-(28), the tightened inputs
U minus F' Z' (53), and the nominal gains K' (49)-(52).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.certificate.margin_checks import margins_report
from hsv.certificate.verification import extreme_factors
from hsv.control.design import ControlDesign
from hsv.design.baseline import (
    DesignResult,
    design_gains,
    disturbance_columns,
    initial_deviation,
    nominal_family,
    nominal_problem,
    nominal_report,
    with_family,
)
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import error_system
from hsv.design.feedback import CommonLyapunov, common_lyapunov
from hsv.design.full_state import full_state_report
from hsv.design.inputs import AdjustableInputs, DesignInputs
from hsv.design.region import Region, incomplete_share
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.tightening import TightenedInputs, tighten
from hsv.design.tube import MeasuredSet, Tube, design_tube, flights_in_tube, flights_report, measured_set
from hsv.design.tube_problem import tube_problem
from hsv.flight.disturbance import ChannelModel
from hsv.lmi.nominal_gain import nominal_gain
from hsv.lmi.semidefinite import BOUND_DIGITS, rounded_to_size
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


def design_adjustable(inputs: DesignInputs, progress: Progress | None = None) -> DesignResult:
    """Return the adjustable design: co-designed model, gain F', invariant set Z' for tau F', nominal gains K'.

    W' is measured like W, but with the fault and the parameter bounds times tau (paper eq. 47), or times the largest
    of five factors. Z' is invariant under tau F' and under F', so that tau may change in flight between its value here
    and 1. The paper's Z' = tau Z would require W' = tau W under F'; the half-widths of tau Z are reported for
    comparison. For K', :func:`relaxed_bound` multiplies the bounds of |u_n| in ``inputs`` by a ratio of tightened
    inputs (eq. 52, eq. 53).

    Arguments and errors are those of :func:`hsv.design.baseline.design_baseline`. DesignError is also raised if
    ``inputs`` has no adjustable factor or an option that an adjustable design does not allow, or if the nominal plan
    exceeds the inputs tightened for tau = 1.
    """
    tau = _checked(inputs).array()
    tell = progress or (lambda stage, done, total: None)
    gains, vehicle = design_gains(inputs, tell), inputs.flown_vehicle
    design = replace(gains.design, tau=tau, tau_minimum=tau, filtered=True)

    tell("common Lyapunov function", 0, 2)
    loops = certified_loops(design, vehicle, inputs.disturbance.elevator_effectiveness)
    lyapunov = common_lyapunov(loops, inputs.error_scale(), "F', common Lyapunov function")
    tell("common Lyapunov function", 1, 2)
    columns = disturbance_columns(inputs)
    full = full_state_report(inputs, design, gains.model.whole, columns)
    tell("common Lyapunov function", 2, 2)

    # The relaxed bounds for K' follow from two sets: Z for W with tau = 1, and Z' for W' with the tau of the design.
    one = replace(design, tau=np.ones(N_RIGID), tau_minimum=np.ones(N_RIGID))
    at_one: Progress = lambda stage, *done: tell(f"{stage}, tau = 1", *done)  # noqa: E731
    complete = measured_set(one, Region(one, inputs, 1.0), inputs, at_one)
    incomplete = measured_set(design, Region(design, inputs, incomplete_share(inputs)), inputs, tell)
    target = inputs.nominal.target
    trimmed = trim(vehicle.decoupled, target.altitude, target.velocity).input
    bound = relaxed_bound(inputs.nominal.input_bound.array(), trimmed, complete.bounds, incomplete.bounds)
    problem = nominal_problem(inputs, design.polytope, bound)
    family = nominal_family(inputs, problem, tell)
    single = nominal_gain(problem, initial_deviation(inputs))
    design = with_family(design, problem, family)

    tube = design_tube(design, inputs, tell)
    room = room_at_one(design, vehicle, tube.report)
    if room.min() < 0.0:
        raise DesignError(
            f"nominal plan at tau = 1: {room.tolist()} of room to U minus F' Z', expected none below zero"
        )
    flown = replace(design, coupling=inputs.disturbance.coupling, tube=tube.found.seen(), plan_bounds=tube.plan)
    report = {
        **gains.report,
        "nominal": nominal_report(inputs, design, family),
        "tube": tube.report,
        "adjustable": {
            **_report(design, inputs, lyapunov, (complete, incomplete), tube),
            "full_state": full,
            "input_bound": bound.tolist(),
            "single_gain": single.report(),
            "room_at_one": room.tolist(),
        },
        "margins": margins_report(flown, vehicle, gains.report["inputs"], tell),
        "parameters_sha256": flown.to_parameters()["design.hash"],
    }
    return DesignResult(flown, gains.model, report)


def _checked(inputs: DesignInputs) -> AdjustableInputs:
    if inputs.adjustable is None:
        raise DesignError("adjustable: missing, expected a table with the factor tau")
    for name, value, expected, why in (
        ("model.system", inputs.model.system, "ECM", "whose feedback is adjusted"),
        ("invariant_set.method", inputs.invariant_set.method, "ellipsoid", "of which two factors can share one"),
        ("tightening.chain", inputs.tightening.chain, "design_bounds", "which grow with the factor's room"),
    ):
        if value != expected:
            raise DesignError(f"{name} = {value!r}: expected {expected!r} in an adjustable design, {why}")
    return inputs.adjustable


def _report(
    design: ControlDesign,
    inputs: DesignInputs,
    lyapunov: CommonLyapunov,
    sets: tuple[MeasuredSet, MeasuredSet],
    tube: Tube,
) -> dict[str, Any]:
    share = incomplete_share(inputs)
    full, model = Region(design, inputs, 1.0), ChannelModel(design, inputs.flown_vehicle)
    beyond = flights_report(flights_in_tube(model, full, tube.found, lambda *_: None))
    tau = np.append(design.tau, [design.tau[-1]] * (len(tube.found.half_width) - N_RIGID))
    complete, incomplete = (each.report() for each in sets)
    return {
        "tau": design.tau.tolist(),
        "tau_minimum": design.tau_minimum.tolist(),
        "share": share,
        "lyapunov": lyapunov.report(),
        "complete": complete,
        "incomplete": incomplete,
        "scaled_half_width": (tau * np.array(complete["invariant_set"]["half_width"])).tolist(),
        "complete_fault": beyond,
    }


def certified_loops(design: ControlDesign, vehicle: Vehicle, effectiveness: float) -> np.ndarray:
    """Return the state matrices, shape (r, n, n), of the closed loops that must share a Lyapunov function.

    There is one for each combination of tube factor (the smallest, then 1; 1 alone if they are equal), elevator
    effectiveness (1, then ``effectiveness``) and vertex, in the order of nested loops: the vertex varies fastest.
    The n states are the errors of the five rigid states, then those of the filter.
    """
    polytope, model = design.polytope, ChannelModel(design, vehicle)

    def loop(factor: np.ndarray, share: float) -> np.ndarray:
        gain = design.feedback_gain[:, :N_RIGID] * factor
        return error_system(polytope.A, polytope.B * np.array([1.0, share]), gain, model.notch, model.columns).A

    return np.concatenate([loop(f, share) for f in extreme_factors(design) for share in (1.0, effectiveness)])


def relaxed_bound(
    bound: np.ndarray, trim_input: np.ndarray, complete: TightenedInputs, incomplete: TightenedInputs
) -> np.ndarray:
    """Return the bounds of |u_n| in eq. 52, shape (2,): ``bound`` times a ratio of tightened inputs, rounded.

    The ratio, by input, is the room within ``incomplete`` (U minus F' Z') over the room within ``complete`` (U minus
    F Z for tau = 1). A room is the distance from the target's ``trim_input`` to the nearer bound (paper eq. 53).

    Raises:
        DesignError: The trim input is not inside the tightened bounds for tau = 1 or for the tau of the design.
    """
    before, after = complete.symmetric(trim_input), incomplete.symmetric(trim_input)
    for name, room in (("U minus F Z at tau = 1", before), ("U minus F' Z'", after)):
        if not room.min() > 0.0:
            raise DesignError(f"{name}: {room.tolist()} about the trim, expected room above zero")
    return rounded_to_size(bound * after / before, 1.0, BOUND_DIGITS)


def room_at_one(design: ControlDesign, vehicle: Vehicle, tube: dict[str, Any]) -> np.ndarray:
    """Return the plan's margins, shape (2,), to the nearer bound of each input, tightened for tau = 1; < 0: beyond it.

    ``tube`` is the report on the tube of ``design``; it contains the plan, the invariant set and the disturbance set.

    Raises:
        DesignError: For tau = 1 the feedback needs the whole range of an input.
    """
    one = replace(design, tau_minimum=np.ones(N_RIGID))
    problem = tube_problem(one, vehicle, DisturbanceSet.from_report(tube["disturbance"]["channels"]))
    bounds = tighten(
        InvariantSet.from_report(problem, tube["invariant_set"]), design.input_minimum, design.input_maximum
    )
    plan = tube["tightening"]["plan"]
    return np.asarray(bounds.margins(np.array(plan["lowest"][:2]), np.array(plan["highest"][:2])).min(axis=1))
