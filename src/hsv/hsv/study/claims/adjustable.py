"""Claims of section 4.3 on the adjustable factor tau."""

from __future__ import annotations

import numpy as np

from hsv.control.nominal_trajectory import FamilyLaw, nominal_data
from hsv.study.claims.claim import Claim, Finding, Reading, shown
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.linear_loop import sampled_loop
from hsv.vehicle.vehicle import load_vehicle

CASE2, WHOLE, BASELINE = "case2", "case2_tau1", "case2_baseline"
DESIGN = "adjustable"


def _relaxed(evidence: Evidence) -> Finding:
    adjustable, baseline = evidence.design(DESIGN).flown, evidence.design("baseline").flown
    ratio = adjustable.nominal_input_bound / baseline.nominal_input_bound
    return Finding(
        (
            Reading("bound of the nominal fuel ratio over the baseline's", float(ratio[0]), "1", at_least=1.0),
            Reading("bound of the nominal elevator over the baseline's", float(ratio[1]), "1", at_least=1.0),
        ),
        "They grow as the room does that Z' leaves the nominal input, over that of Z. The baseline's bounds are "
        "chosen: (30) to (35) as printed are too tight to fly the step ([errata](errata.md)).",
        leading=2,
    )


def _better(evidence: Evidence) -> Finding:
    step, baseline, flown = evidence.adjustable_step(), evidence.corners("case1"), evidence.design(DESIGN).flown
    law = FamilyLaw(nominal_data(flown))
    planned = np.abs([law.step(deviation).input for deviation in evidence.flights[CASE2].deviation])
    used = float((planned / flown.nominal_input_bound).max())

    def settling(name: str) -> Reading:
        measure = f"{name}_settling_time"
        return Reading(
            f"{name} settling on the step of Case 1, adjustable over baseline",
            step[measure] / nominal(baseline, measure),
            "1",
            at_most=1.0,
        )

    h, v = (
        evidence.spread(CASE2, measure)
        .over(evidence.spread(WHOLE, measure))
        .readings(f"{name} error along the ramp, tau = {_tau(evidence):g} over tau = 1", "1", at_most=1.0)
        for name, measure in (
            ("altitude", "altitude_integral_absolute_error"),
            ("velocity", "velocity_integral_absolute_error"),
        )
    )
    return Finding(
        (h[0], v[0], *h[1:], *v[1:], settling("velocity"), settling("altitude")),
        f"Integral of the error. Along the ramp the nominal inputs take {100 * used:.0f} % of their bounds, so that "
        "wider ones gain nothing, and the weaker feedback tau F' tracks less closely. On a step, where they count, "
        f"velocity settles in {shown(step['velocity_settling_time'], 's')} instead of "
        f"{shown(nominal(baseline, 'velocity_settling_time'), 's')}, altitude in "
        f"{shown(step['altitude_settling_time'], 's')} instead of "
        f"{shown(nominal(baseline, 'altitude_settling_time'), 's')}.",
        leading=2,
    )


def _less_robust(evidence: Evidence) -> Finding:
    ramp, whole, tau = evidence.corners(CASE2), evidence.corners(WHOLE), _tau(evidence)
    name = "post_fault_attitude_from_nominal"
    return Finding(
        (
            Reading(
                f"attitude from nominal after the fault, worst corners, tau = {tau:g} over 1",
                worst(ramp, name) / worst(whole, name),
                "1",
                at_least=1.0,
            ),
            Reading("the same, nominal vehicle", nominal(ramp, name) / nominal(whole, name), "1", at_least=1.0),
            Reading(
                f"altitude error at the end, tau = {tau:g} over 1, worst corners",
                worst(ramp, "altitude_end_error") / worst(whole, "altitude_end_error"),
                "1",
                at_least=1.0,
            ),
        ),
        f"Robustness: how far the worst vehicle goes, {shown(worst(ramp, name), 'rad')} with tau = {tau:g}, "
        f"{shown(worst(whole, name), 'rad')} with the whole feedback.",
    )


def _further_stable(evidence: Evidence) -> Finding:
    flown = evidence.design(DESIGN).flown
    tau = _tau(evidence)

    def gained(coupling: str) -> np.ndarray:
        lower, whole = (evidence.growth(coupling, flown.notch, DESIGN, factor) for factor in (tau, 1.0))
        return np.asarray(lower - whole)

    like, derived = gained("paper_like"), gained("derived")
    what = f"growth with tau = {tau:g} less that with 1"
    unstable = [
        int(np.count_nonzero(evidence.growth("derived", flown.notch, DESIGN, factor) > 0.0)) for factor in (tau, 1.0)
    ]
    return Finding(
        (
            Reading(f"{what}, paper-like coupling, nominal vehicle", float(like[0]), "1/s", at_most=0.0),
            Reading(f"{what}, paper-like coupling, worst corner", float(like.max()), "1/s", at_most=0.0),
            Reading(f"{what}, derived coupling, nominal vehicle", float(derived[0]), "1/s", at_most=0.0),
            Reading(f"{what}, derived coupling, worst corner", float(derived.max()), "1/s", at_most=0.0),
        ),
        "Growth: largest real part of the loop's poles. With the derived coupling a weaker feedback feeds less "
        f"vibration back: {unstable[0]} of {evidence.vehicles} loops are unstable with tau = {tau:g}, {unstable[1]} "
        f"with 1. With the paper-like coupling the slowest pole, at {abs(_slowest(evidence, 1.0).imag):.1f} rad/s with "
        f"1, is one at {abs(_slowest(evidence, tau).imag):.1f} rad/s with {tau:g}: there the rigid body wants the "
        "feedback. How far below the certified range the loop stays stable: [factor](study/factor.md).",
    )


def _slowest(evidence: Evidence, factor: float) -> complex:
    """Return the slowest pole, rad/s, of the nominal loop with the paper-like coupling at the end of Case 1's step."""
    flown = evidence.design(DESIGN).flown
    vehicle = load_vehicle().coupled("paper_like")
    poles = sampled_loop(vehicle, factor * flown.feedback_gain, flown.notch, flown.period).poles
    return complex(poles[np.argmax(poles.real)])


def _tau(evidence: Evidence) -> float:
    return float(evidence.design(DESIGN).flown.tau.min())


_TAU = (
    "When τ is decreased, the nominal system constraint is relaxed such that the control performance becomes better "
    "and the robustness is worse."
)

CLAIMS = (
    Claim(
        "a smaller tau relaxes the nominal inputs",
        "From (46), it can be seen that τ expands the constraint range of nominal control input.",
        "4.3",
        _relaxed,
    ),
    Claim("a smaller tau performs better", _TAU, "4.3", _better),
    Claim("a smaller tau is less robust", _TAU, "4.3", _less_robust),
    Claim(
        "tau guarantees stability further",
        "By adjusting τ, the stability of the closed-loop system can be further guaranteed.",
        "4.3",
        _further_stable,
    ),
)
