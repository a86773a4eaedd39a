"""Claims of section 5.2 on the elastic modes in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.claims.spread import Spread
from hsv.study.claims.thresholds import A_LOT, SIGNIFICANT, SLIGHT, SOON
from hsv.study.linear_loop import critical_coupling
from hsv.vehicle.vehicle import load_vehicle

TUBE, WITHOUT, DERIVED = "case1", "case1_no_notch", "case1_derived"
RMPC, FOURTH, SECOND_MODE = "case1_rmpc", "case1_rmpc_fourth_k", "case1_second_mode_notch"
SETTLED = "elastic_settling_time"


def _return(evidence: Evidence) -> Finding:
    derived, without = evidence.corners(DERIVED), evidence.spread(WITHOUT, SETTLED)
    return Finding(
        (
            *evidence.spread(TUBE, SETTLED).readings("rates decayed after, with notch", "s", at_most=SOON),
            Reading("the same, derived coupling, worst corner", worst(derived, SETTLED), "s", at_most=SOON),
            *without.readings("rates decayed after, without notch", "s", at_most=SOON)[:2],
        ),
        "Time after the fault from which both rates stay within 5 % of their peak. Figure 11 shows flights with the "
        f"filter and without; without it {_undecayed(without)} of {evidence.vehicles} have not decayed at the end.",
    )


def _undecayed(spread: Spread) -> int:
    return int(np.count_nonzero(~np.isfinite(spread.vehicles)))


def _rmpc_coordinates(evidence: Evidence) -> Finding:
    swing = evidence.spread(RMPC, "post_fault_attitude_deviation").over(
        evidence.spread(TUBE, "post_fault_attitude_deviation")
    )
    return _rmpc_spans(
        evidence,
        "coordinate",
        "The coordinates follow the angle of attack, and the attitude swings "
        f"{swing.nominal:.0f} times as far with robust MPC: that is bending, not vibration.",
    )


def _rmpc_rates(evidence: Evidence) -> Finding:
    return _rmpc_spans(
        evidence,
        "rate",
        "In the decoupled model, which robust MPC flies in the paper too, nothing feeds vibration back; the rates are "
        "those of the fault's jolt.",
    )


def _rmpc_spans(evidence: Evidence, what: str, why: str) -> Finding:
    def readings(scenario: str, mode: str, gain: str) -> tuple[Reading, ...]:
        measure = f"elastic_{what}_{mode}_span"
        ratio = evidence.spread(scenario, measure).over(evidence.spread(TUBE, measure))
        name = {"1": "first", "2": "second"}[mode]
        return ratio.readings(f"span of the {name} {what}, RMPC ({gain} gain) over tube", "1", at_least=A_LOT)

    single, fourth = (
        [readings(scenario, mode, gain) for mode in ("1", "2")]
        for scenario, gain in ((RMPC, "single"), (FOURTH, "fourth"))
    )
    return Finding(
        (*(rows[0] for rows in single), *(row for rows in single for row in rows[1:]), *(r for f in fourth for r in f)),
        f"Span: largest less least value after the fault. {why}",
        leading=2,
    )


def _jitter(evidence: Evidence) -> Finding:
    first, second = (
        evidence.spread(TUBE, measure)
        .over(evidence.spread(WITHOUT, measure))
        .readings(f"span of the {name} rate, with over without notch", "1", at_most=1.0)
        for name, measure in (("first", "elastic_rate_1_ringing"), ("second", "elastic_rate_2_ringing"))
    )
    return Finding(
        (first[0], second[0], *first[1:], *second[1:]),
        "Largest less least value between 10 s and 20 s after the fault.",
        leading=2,
    )


def _second_mode(evidence: Evidence) -> Finding:
    ratio = np.abs(_with_second_over_without(evidence, 2))
    return Finding(
        (
            Reading(
                "span of the second rate, with over without, nominal vehicle",
                float(ratio[0]),
                "1",
                at_most=SIGNIFICANT,
            ),
            Reading("the same, worst corner", float(ratio.max()), "1", at_most=SIGNIFICANT),
        ),
        "Between 10 s and 20 s after the fault; the paper shows the nominal system.",
    )


def _second_mode_on_first(evidence: Evidence) -> Finding:
    ratio = _with_second_over_without(evidence, 1)
    return Finding(
        (
            Reading(
                "an inhibition: span of the first rate, with over without, nominal vehicle",
                float(ratio[0]),
                "1",
                at_most=1.0,
            ),
            Reading("a slight one: the same", float(ratio[0]), "1", at_least=SLIGHT),
            Reading("an inhibition, worst corner", float(ratio.max()), "1", at_most=1.0),
        ),
        "The filter is wide enough to take the destabilising feedback from both modes.",
        leading=2,
    )


def _with_second_over_without(evidence: Evidence, mode: int) -> np.ndarray:
    measure = f"elastic_rate_{mode}_ringing"
    return np.asarray(evidence.corners(SECOND_MODE)[measure] / evidence.corners(WITHOUT)[measure])


def _rejected_paper_like(evidence: Evidence) -> Finding:
    without, table = evidence.spread(WITHOUT, SETTLED), evidence.corners(WITHOUT)
    flown = evidence.design("baseline").flown
    limit = critical_coupling(flown.feedback_gain, (), flown.period)
    unstable = int(np.count_nonzero(evidence.growth("paper_like", ()) > 0.0))
    scale = load_vehicle().coupling_scale("paper_like")
    margin = "" if limit is None else f", {100 * (limit / scale - 1.0):.1f} % above the paper-like one"
    return Finding(
        (
            *evidence.spread(TUBE, SETTLED).readings("rates decayed after, with notch", "s", at_most=SOON),
            *without.readings("rates decayed after, without notch", "s", at_least=SOON),
        ),
        f"Without the filter no flight of {evidence.vehicles} decays sooner than the last reading, and "
        f"{_undecayed(without)} have not at the end; {table['diverged'].sum():.0f} are lost. How slowly they decay "
        "hangs on the coupling: the nominal loop without filter stops being stable at "
        f"{'no share' if limit is None else f'{limit:.4f}'} of the derived one{margin}, and {unstable} of "
        f"{evidence.vehicles} loops are unstable there.",
    )


def _rejected_derived(evidence: Evidence) -> Finding:
    without, with_notch = evidence.changed("case1_derived_no_notch"), evidence.corners(DERIVED)
    section, other = (evidence.design(name).flown.notch[0] for name in ("baseline_derived", "baseline"))
    unstable = int(np.count_nonzero(evidence.growth("derived", evidence.design("baseline").flown.notch) > 0.0))
    return Finding(
        (
            Reading("decayed after, with notch, nominal vehicle", nominal(with_notch, SETTLED), "s", at_most=SOON),
            Reading("the same, worst corner", worst(with_notch, SETTLED), "s", at_most=SOON),
            Reading("flight without notch lost (1: yes), nominal vehicle", without["diverged"], "1", at_least=1.0),
        ),
        f"Without the filter the flight is lost at {without['end_time']:.1f} s: with this coupling the filter is not "
        f"an improvement but what makes flight possible. It is at {section.zero_frequency:g} rad/s; the one at "
        f"{other.zero_frequency:g} rad/s leaves {unstable} of {evidence.vehicles} loops unstable.",
    )


_RMPC = "Similarly, using the traditional RMPC control, they vibrate a lot more."
_SECOND = (
    "It can be known that the notch filter has a slight inhibition on the derivative of the first-order flexible mode, "
    "and a significant impact on the derivative of the second-order flexible mode."
)
_REJECTED = "By introducing notch filter, the flexible modes can be rejected."

CLAIMS = (
    Claim(
        "elastic coordinates return",
        "They vibrate after fault occurs, but soon return to stability.",
        "5.2, Figure 11",
        _return,
    ),
    Claim("RMPC vibrates more: coordinates", _RMPC, "5.2, Figure 11", _rmpc_coordinates),
    Claim("RMPC vibrates more: derivatives", _RMPC, "5.2, Figure 11", _rmpc_rates),
    Claim(
        "jitter",
        "The jitter of the system under Tube-MPC with notch filter is gentler and smoother.",
        "5.2, Figure 11",
        _jitter,
    ),
    Claim("second notch: on the second mode", _SECOND, "5.2, Figure 13", _second_mode),
    Claim("second notch: slight on the first mode", _SECOND, "5.2, Figure 13", _second_mode_on_first),
    Claim("modes rejected, paper-like coupling", _REJECTED, "5.2", _rejected_paper_like),
    Claim("modes rejected, derived coupling", _REJECTED, "5.2", _rejected_derived),
)
