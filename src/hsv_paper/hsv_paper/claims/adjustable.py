"""Numbers of sections 4.3 and 5.2 on the adjustable factor tau."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.controller import used_inputs
from hsv_paper.claims.evidence import Evidence, nominal, worst
from hsv_paper.claims.finding import shown
from hsv_paper.linear_loop import sampled_loop

DESIGN = "adjustable"


def relaxed(evidence: Evidence) -> dict[str, Any]:
    """Return the bounds of the nominal inputs relative to the baseline's."""
    adjustable, baseline = evidence.design(DESIGN).flown, evidence.design("baseline").flown
    ratio = adjustable.nominal_input_bound / baseline.nominal_input_bound
    return {"fuel": ratio[0], "elevator": ratio[1]}


def step(evidence: Evidence) -> dict[str, Any]:
    """Return the settling of the step of Case 1 relative to the baseline, and the inputs used by Case 2's ramp (%)."""
    adjustable, baseline = evidence.adjustable_step(), evidence.corners("case1")
    found: dict[str, Any] = {"tau": _tau(evidence), "used": 100 * used_inputs(evidence, "case2", DESIGN)}
    for axis in ("velocity", "altitude"):
        time, before = adjustable[f"{axis}_settling_time"], nominal(baseline, f"{axis}_settling_time")
        found |= {axis: time / before, f"{axis}_time": shown(time, "s"), f"{axis}_baseline": shown(before, "s")}
    return found


def less_robust(evidence: Evidence) -> dict[str, Any]:
    """Return the ratio between the worst vehicle with tau and the worst one with the whole feedback."""
    ramp, whole = evidence.corners("case2"), evidence.corners("case2_tau1")
    measures = {"attitude": "post_fault_attitude_from_nominal", "altitude": "altitude_end_error"}
    return {"tau": _tau(evidence)} | {
        name: worst(ramp, measure) / worst(whole, measure) for name, measure in measures.items()
    }


def further_stable(evidence: Evidence) -> dict[str, Any]:
    """Return the growth (vehicles), 1/s, of the loops with tau less that with 1, and the nominal one's slowest pole."""
    flown, tau = evidence.design(DESIGN).flown, _tau(evidence)
    like, derived = (
        [evidence.growth(coupling, flown.notch, DESIGN, factor) for factor in (tau, 1.0)]
        for coupling in ("paper_like", "derived")
    )
    unstable, unstable_whole = (int(np.count_nonzero(growth > 0.0)) for growth in derived)
    return {
        "tau": tau,
        "paper_like": like[0] - like[1],
        "derived": derived[0] - derived[1],
        "unstable": unstable,
        "unstable_whole": unstable_whole,
        "slowest": abs(_slowest(evidence, tau).imag),
        "slowest_whole": abs(_slowest(evidence, 1.0).imag),
    }


def _slowest(evidence: Evidence, factor: float) -> complex:
    """Return the slowest pole, rad/s, of the nominal loop with the paper-like coupling at the end of Case 1's step."""
    flown = evidence.design(DESIGN).flown
    vehicle = load_vehicle().coupled("paper_like")
    poles = sampled_loop(vehicle, factor * flown.feedback_gain, flown.notch, flown.period).poles
    return complex(poles[np.argmax(poles.real)])


def _tau(evidence: Evidence) -> float:
    return float(evidence.design(DESIGN).flown.tau.min())
