"""Claims of section 3.3 and of the abstract on the notch filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsv.control.notch_filter import NotchSection, discretise
from hsv.lpv.frequency import bode
from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.claims.modelling import ELASTIC_PEAKS
from hsv.study.figures.bode import notch_response, peak, pitch_rate_response
from hsv.study.linear_loop import TARGET, Margin, phase_margins, sampled_loop
from hsv.vehicle.parameters import vehicle_parameters

WITH, WITHOUT = "case1", "case1_no_notch"


def reductions(evidence: Evidence) -> dict[str, float]:
    """Return by how many dB the design's filter lowers each mode's peak, elevator to filtered pitch rate."""
    frequencies = np.linspace(10.0, 25.0, 6000)
    plain = pitch_rate_response(vehicle_parameters("paper_like"), frequencies)
    filtered = plain * notch_response(evidence.design("baseline").flown.notch, frequencies)
    before, after = bode(plain)[0], bode(filtered)[0]
    at = {name: peak(frequencies, plain, *window) for name, window in ELASTIC_PEAKS.items()}
    return {name: float(before[index] - after[index]) for name, index in at.items()}


def _peaks(evidence: Evidence) -> Finding:
    fall = reductions(evidence)
    return Finding(
        (
            Reading("fall of the first mode's peak", fall["first"], "dB", at_least=20.0),
            Reading("fall of the second mode's peak", fall["second"], "dB", at_least=20.0),
        ),
        "One section takes out one mode; the other is at its edge.",
    )


def _suppressed(evidence: Evidence) -> Finding:
    fall = reductions(evidence)
    return Finding(
        (Reading("fall of the first mode's peak", fall["first"], "dB", at_least=10.0),), "See Figures 3 and 5."
    )


def _partially(evidence: Evidence) -> Finding:
    fall = reductions(evidence)
    return Finding(
        (
            Reading("fall of the second mode's peak", fall["second"], "dB", at_least=3.0),
            Reading("fall of the second mode's peak", fall["second"], "dB", at_most=fall["first"]),
        ),
        "By the width of the poles, damping 0.5.",
    )


def _unaffected(evidence: Evidence) -> Finding:
    section = evidence.design("baseline").flown.notch
    crossover = _margins(evidence, ())[0].frequency
    passed = notch_response(section, np.array([1.0, crossover]))
    loss, lag = -bode(passed)[0], -np.angle(passed)
    return Finding(
        (
            Reading("loss at 1 rad/s", float(loss[0]), "dB", at_most=0.5),
            Reading("phase lag at 1 rad/s", float(lag[0]), "rad", at_most=np.radians(5.0)),
            Reading(f"loss at the rigid body's crossover, {crossover:.1f} rad/s", float(loss[1]), "dB", at_most=0.5),
            Reading("phase lag there", float(lag[1]), "rad", at_most=np.radians(5.0)),
            Reading("fall of the second mode's peak", reductions(evidence)["second"], "dB", at_most=0.5),
        ),
        "Slow signals pass. A filter wide enough for an uncertain mode takes phase from the loop below it; that it "
        "lowers the second mode above it is welcome.",
    )


def _without_notch(evidence: Evidence) -> Finding:
    growth, derived = evidence.growth("paper_like", ()), evidence.growth("derived", ())
    table = evidence.corners(WITHOUT)
    lost = int(np.count_nonzero(growth > 0.0))
    return Finding(
        (
            Reading("growth of the loop, nominal, paper-like coupling", float(growth[0]), "1/s", at_most=0.0),
            Reading("growth, worst corner, paper-like coupling", float(growth.max()), "1/s", at_most=0.0),
            Reading("growth, nominal, derived coupling", float(derived[0]), "1/s", at_most=0.0),
        ),
        "The paper-like coupling was chosen so that the nominal vehicle is stable. "
        f"Without the notch {lost} of {len(growth)} vehicles are unstable, most slowly (worst second-mode ringing in "
        f"flight: {worst(table, 'elastic_rate_2_span') / nominal(table, 'elastic_rate_2_span'):.0f} times the "
        "nominal). The stability proof is one of the decoupled model.",
    )


def _not_destroyed(evidence: Evidence) -> Finding:
    like = evidence.growth("paper_like", evidence.design("baseline").flown.notch)
    baseline = evidence.growth("derived", evidence.design("baseline").flown.notch)
    retuned = evidence.design("baseline_derived").flown.notch
    derived = evidence.growth("derived", retuned, "baseline_derived")
    return Finding(
        (
            Reading("growth, nominal, paper-like coupling", float(like[0]), "1/s", at_most=0.0),
            Reading("growth, worst corner, paper-like coupling", float(like.max()), "1/s", at_most=0.0),
            Reading(
                "growth, worst corner, derived coupling, notch at 15 rad/s", float(baseline.max()), "1/s", at_most=0.0
            ),
            Reading(
                "growth, worst corner, derived coupling, notch at 14 rad/s", float(derived.max()), "1/s", at_most=0.0
            ),
        ),
        "More than not destroyed: with the paper-like coupling the filter makes every vehicle stable, also those that "
        "are not without it. What a reasonable choice is depends on the coupling.",
    )


def _margins(evidence: Evidence, notch: tuple[NotchSection, ...]) -> list[Margin]:
    """Return the margins of the loop broken at the elevator, the slowest crossover, the rigid body's, first."""
    flown = evidence.design("baseline").flown
    frequencies = np.logspace(-1.0, np.log10(0.95 * np.pi / flown.period), 40000)
    loop = sampled_loop(vehicle_parameters("paper_like"), flown.feedback_gain, notch, flown.period, point=TARGET)
    return sorted(phase_margins(frequencies, loop.elevator_loop(frequencies)), key=lambda margin: margin.frequency)


def _phase_margin(evidence: Evidence) -> Finding:
    found = {"without": _margins(evidence, ()), "with": _margins(evidence, evidence.design("baseline").flown.notch)}
    smallest = {name: min(margin.phase for margin in margins) for name, margins in found.items()}
    rigid = {name: margins[0] for name, margins in found.items()}
    return Finding(
        (
            Reading(
                "gain of the smallest margin of all crossovers",
                smallest["with"] - smallest["without"],
                "rad",
                at_least=0.0,
            ),
            Reading(
                "gain of the margin at the rigid body's crossover",
                rigid["with"].phase - rigid["without"].phase,
                "rad",
                at_least=0.0,
            ),
        ),
        "Loop broken at the elevator. Without the notch the second mode crosses unit gain with "
        f"{np.degrees(smallest['without']):.1f} deg left; the notch removes that crossing. At the rigid body's own "
        f"crossover, {rigid['without'].frequency:.1f} rad/s, it costs phase: {np.degrees(rigid['without'].phase):.0f} "
        f"deg before, {np.degrees(rigid['with'].phase):.0f} deg after.",
    )


def _still_in_the_set(evidence: Evidence) -> Finding:
    table = evidence.corners(WITH)
    return Finding(
        (Reading("worst level with the notch, 1024 corners", worst(table, "tube_level"), "1", at_most=1.0),),
        "Not because filtering reduces uncertainty: the set was computed with the filter in the loop, its states "
        "among it.",
    )


def _closer(evidence: Evidence) -> Finding:
    a, b = evidence.corners(WITH), evidence.corners(WITHOUT)
    whole, rate = a["rigid_error"] / b["rigid_error"], a["pitch_rate_error"] / b["pitch_rate_error"]
    return Finding(
        (
            Reading("rigid error with over without notch, nominal", float(whole[0]), "1", at_most=1.0),
            Reading("rigid error with over without notch, worst corner", float(whole.max()), "1", at_most=1.0),
            Reading("closer by 5 % or more: the same, nominal", float(whole[0]), "1", at_most=0.95),
            Reading("pitch-rate error with over without notch, nominal", float(rate[0]), "1", at_most=1.0),
            Reading("pitch-rate error with over without notch, worst corner", float(rate.max()), "1", at_most=1.0),
        ),
        "Root mean square over the 20 s after the fault. The notch changes the vibration and little else: the rigid "
        f"error is closer by {100.0 * (1.0 - whole[0]):.1f} % for the nominal vehicle; at the corners parameters make "
        "the error.",
    )


def _better(evidence: Evidence) -> Finding:
    a, b = evidence.corners(WITH), evidence.corners(WITHOUT)
    return Finding(
        (
            Reading(
                "decay time with over without, nominal",
                nominal(a, "elastic_decay_time") / nominal(b, "elastic_decay_time"),
                "1",
                at_most=1.0,
            ),
            Reading(
                "decay time with over without, worst corner",
                worst(a, "elastic_decay_time") / worst(b, "elastic_decay_time"),
                "1",
                at_most=1.0,
            ),
            Reading(
                "post-fault attitude with over without, nominal",
                nominal(a, "post_fault_attitude_deviation") / nominal(b, "post_fault_attitude_deviation"),
                "1",
                at_most=1.0,
            ),
            Reading(
                "altitude error at the end with over without, nominal",
                abs(nominal(a, "altitude_end_error") / nominal(b, "altitude_end_error")),
                "1",
                at_most=1.001,
            ),
            Reading(
                "largest altitude error after the fault with over without, nominal",
                nominal(a, "post_fault_altitude_error") / nominal(b, "post_fault_altitude_error"),
                "1",
                at_most=1.001,
            ),
        ),
        "Vibration decays sooner by far; attitude moves a little less; altitude is held no better.",
    )


def _unit_circle(evidence: Evidence) -> Finding:
    flown = evidence.design("baseline").flown
    ours = flown.notch[0]

    def distance(damping: float) -> float:
        data = discretise((replace(ours, zero_damping=damping),), flown.period)
        zeros = np.linalg.eigvals(data.A[0] - np.outer(data.B[0], data.C[0]) / data.D[0])
        return float(np.abs(np.abs(zeros) - 1.0).max())

    return Finding(
        (
            Reading("distance of the zeros from the unit circle, epsilon_z = 0", distance(0.0), "1", at_most=1e-6),
            Reading(
                f"the same, epsilon_z = {ours.zero_damping:g}, ours", distance(ours.zero_damping), "1", at_most=1e-6
            ),
        ),
        "Only for a zero numerator damping, epsilon_z = 0: then the notch is infinitely deep, and a mode beside it is "
        f"missed. Ours is {-20.0 * np.log10(ours.zero_damping / ours.pole_damping):.0f} dB deep.",
    )


CLAIMS = (
    Claim(
        "peaks eliminated",
        "In order to weaken the effect of flexibility, a notch filter is introduced to eliminate the frequency "
        "response peak of flexible modes.",
        "Abstract",
        _peaks,
    ),
    Claim(
        "peak suppressed",
        "From the figure, it can be seen that the peak caused by the flexible mode is suppressed after the notch "
        "filter is connected into the flexible hypersonic vehicle.",
        "3.3, Figure 3",
        _suppressed,
    ),
    Claim(
        "second mode partially decreased",
        "Meanwhile, the second-order flexible mode is partially decreased at the edge of notch filter.",
        "3.3, Figure 5",
        _partially,
    ),
    Claim(
        "other frequencies unaffected",
        "First of all, the principle of notch filter is that the non-notch frequency is not affected, so only the "
        "first flexible mode is filtered out.",
        "3.3",
        _unaffected,
    ),
    Claim(
        "stable without the notch",
        "The Tube-MPC controller designed above can guarantee the stability of the rigid body states and flexible "
        "states of hypersonic vehicle with actuator faults.",
        "3.3",
        _without_notch,
    ),
    Claim(
        "stability is not destroyed",
        "In conclusion, the reasonable choice of notch filter will not destroy the stability of the original system.",
        "3.3",
        _not_destroyed,
    ),
    Claim(
        "phase margin",
        "As previously analysed, the appropriate parameter selection of notch filter will not destroy the stability "
        "of the original system, and will even increase the phase margin of the system.",
        "3.3",
        _phase_margin,
    ),
    Claim(
        "states stay in the mRPI set",
        "Therefore, the system states still stay in mRPI set after filtering.",
        "3.3",
        _still_in_the_set,
    ),
    Claim(
        "closer to the nominal trajectory",
        "At the same time, compared with the system without notch filter, the position of system states with notch "
        "filter in the mRPI set is closer to the nominal trajectory, as shown in Figure 6.",
        "3.3, Figure 6",
        _closer,
    ),
    Claim(
        "better than without",
        "Moreover, the performance of system with notch filter is better than without notch filter.",
        "3.3",
        _better,
    ),
    Claim(
        "zeros on the unit circle",
        "The notch is deep enough and has a certain width. All zeros of transfer function of notch filter should be "
        "on the unit circle.",
        "3.3 (1)",
        _unit_circle,
    ),
)
