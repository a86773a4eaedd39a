"""Claims of section 5.2 on the attitude in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.claim import Claim, Finding, Reading, shown
from hsv.study.claims.evidence import Evidence, worst
from hsv.study.claims.thresholds import HALF_DEGREE, SOON
from hsv.study.measures import SETTLED

TUBE, WITHOUT, DERIVED = "case1", "case1_no_notch", "case1_derived"
RMPC, FOURTH = "case1_rmpc", "case1_rmpc_fourth_k"
EXCURSION, RINGING = "post_fault_attitude_deviation", "pitch_rate_ringing"


def _soon(evidence: Evidence) -> Finding:
    attitude, rate = (evidence.spread(TUBE, f"{name}_settling_time") for name in ("attitude", "pitch_rate"))
    derived = evidence.corners(DERIVED)
    a = attitude.readings("angles settled after", "s", at_most=SOON)
    q = rate.readings("pitch rate settled after", "s", at_most=SOON)
    return Finding(
        (
            a[0],
            q[0],
            *a[1:],
            *q[1:],
            Reading(
                "angles, derived coupling, worst corner", worst(derived, "attitude_settling_time"), "s", at_most=SOON
            ),
            Reading(
                "pitch rate, derived coupling, worst corner",
                worst(derived, "pitch_rate_settling_time"),
                "s",
                at_most=SOON,
            ),
        ),
        f"Time after the fault from which each stays within {100 * SETTLED:g} % of its largest excursion about where "
        "it ends, the equilibrium with less elevator.",
        leading=2,
    )


def _smaller_than_rmpc(evidence: Evidence) -> Finding:
    tube, fourth, single = (evidence.spread(name, EXCURSION) for name in (TUBE, FOURTH, RMPC))
    ringing = evidence.spread(TUBE, RINGING).over(evidence.spread(RMPC, RINGING))
    a = tube.over(single).readings("attitude excursion over that of RMPC (single gain)", "1", at_most=1.0)
    q = ringing.readings("span of the pitch rate 10 s to 20 s after the fault, over the same", "1", at_most=1.0)
    return Finding(
        (
            a[0],
            q[0],
            *a[1:],
            *q[1:],
            *tube.over(fourth).readings("attitude excursion over that of RMPC (fourth gain)", "1", at_most=1.0),
        ),
        f"Nominal vehicle: {shown(tube.nominal, 'rad')} with the tube, {shown(fourth.nominal, 'rad')} and "
        f"{shown(single.nominal, 'rad')} with robust MPC.",
        leading=2,
    )


def _gentler(evidence: Evidence) -> Finding:
    ringing, excursion = (evidence.spread(TUBE, m).over(evidence.spread(WITHOUT, m)) for m in (RINGING, EXCURSION))
    q = ringing.readings("span of the pitch rate 10 s to 20 s after the fault, with over without", "1", at_most=1.0)
    a = excursion.readings("attitude excursion, with over without", "1", at_most=1.0)
    return Finding(
        (q[0], a[0], *q[1:], *a[1:]),
        "The excursion is the fault's and changes little; what rings afterwards is what the filter takes away.",
        leading=2,
    )


def _own_mean(evidence: Evidence) -> Finding:
    return _half_degree(evidence, EXCURSION, "Change after the fault from the mean of the 5 s before it.")


def _from_nominal(evidence: Evidence) -> Finding:
    return _half_degree(
        evidence,
        "post_fault_attitude_from_nominal",
        "Distance from reference and nominal trajectory after the fault; a vehicle at a corner has another trim.",
    )


def _whole_flight(evidence: Evidence) -> Finding:
    return _half_degree(
        evidence,
        "attitude_from_nominal",
        "Distance from reference and nominal trajectory from t = 0: perturbed vehicles start away from their own trim.",
    )


def _from_command(evidence: Evidence) -> Finding:
    return _half_degree(
        evidence,
        "attitude_from_reference",
        "Distance from the commanded equilibrium over the whole flight: the manoeuvre is in it.",
    )


def _half_degree(evidence: Evidence, measure: str, why: str) -> Finding:
    spread, derived = evidence.spread(TUBE, measure), evidence.corners(DERIVED)
    beyond = int(np.count_nonzero(~(spread.vehicles <= HALF_DEGREE)))
    return Finding(
        (
            *spread.readings("larger of angle of attack and pitch angle", "rad", at_most=HALF_DEGREE),
            Reading("the same, derived coupling, worst corner", worst(derived, measure), "rad", at_most=HALF_DEGREE),
        ),
        f"{why} {beyond} of {evidence.vehicles} vehicles exceed it.",
    )


def _certified(evidence: Evidence) -> Finding:
    tube = evidence.design("baseline").flown.tube
    assert tube is not None
    return Finding(
        (
            Reading(
                "half-width of the invariant set in attitude",
                float(tube.half_width[2:4].max()),
                "rad",
                at_most=HALF_DEGREE,
            ),
        ),
        "What the set guarantees for any disturbance in W, in place of what flights show.",
    )


_HALF_DEGREE = "The dynamic error of the longitudinal attitude angles is within ±0.5°."

CLAIMS = (
    Claim(
        "attitude settles soon",
        "Figure 10 shows attack angle, pitch angle, and pitch rate vibrate when fault occurs but soon stabilize at "
        "equilibrium.",
        "5.2, Figure 10",
        _soon,
    ),
    Claim(
        "smaller than with RMPC",
        "Compared with the traditional RMPC, the vibration is smaller.",
        "5.2, Figure 10",
        _smaller_than_rmpc,
    ),
    Claim(
        "gentler with the notch",
        "Compared with Tube-MPC without notch filter, the state change of Tube-MPC with notch filter is gentler and "
        "smoother after fault occurs.",
        "5.2, Figure 10",
        _gentler,
    ),
    Claim("±0.5°: change after the fault", _HALF_DEGREE, "5.2", _own_mean),
    Claim("±0.5°: from nominal after the fault", _HALF_DEGREE, "5.2", _from_nominal),
    Claim("±0.5°: from nominal, whole flight", _HALF_DEGREE, "5.2", _whole_flight),
    Claim("±0.5°: from the command, whole flight", _HALF_DEGREE, "5.2", _from_command),
    Claim("±0.5°: guaranteed by the set", _HALF_DEGREE, "5.2", _certified),
)
