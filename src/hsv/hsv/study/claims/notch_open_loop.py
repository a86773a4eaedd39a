"""The notch filter alone and on the open loop: what it does to peaks, to other frequencies, and where its zeros are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hsv.control.notch_filter import NotchSection, discretise, flown_sections, notch_response
from hsv.lpv.frequency import bode, frequency_response
from hsv.simulation.assembly import flight_parameters
from hsv.simulation.scenario import load_scenario
from hsv.study.claims.claim import Finding, Reading
from hsv.study.claims.evidence import Evidence
from hsv.study.claims.modelling import RAISED
from hsv.study.claims.notch_loop import margins
from hsv.study.figures.figure_03 import POLE_DAMPINGS, POLE_FREQUENCIES
from hsv.study.linear_loop import ELEVATOR, START
from hsv.study.mode_peaks import FREQUENCIES, peak_falls
from hsv.vehicle.dynamics import N_RIGID, PITCH_RATE, jacobian
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.trim import trim
from hsv.vehicle.vehicle import load_vehicle

ELIMINATED, SUPPRESSED = 20.0, 10.0
"""dB: a tenth of a peak's height is left, about a third of it."""

UNCHANGED = {"dB": 0.5, "rad": float(np.radians(5.0))}
"""6 % of a gain, 5 deg of phase: less is lost in the uncertainty of the vehicle."""


def _section(evidence: Evidence, design: str = "baseline") -> NotchSection:
    return evidence.design(design).flown.notch[0]


def _falls(sections: Sequence[NotchSection], coupling: str = "paper_like") -> dict[str, float]:
    return {name: fall.decibel for name, fall in peak_falls(sections, coupling).items()}


def coupling_in_pitch_rate(evidence: Evidence) -> Finding:
    """Judge the share of the pitch rate in what coupling changes."""
    sizes = evidence.design("baseline").certificate["inputs"]["model"]["tensor_product"]["state_scale"]
    scale = np.array(list(sizes.values()))
    (A, B), (A_alone, B_alone) = (_linearised(load_vehicle().coupled(name)) for name in ("paper_like", 0.0))
    change = ((A - A_alone) * scale / scale[:, None]) ** 2
    onto_rigid, onto_elastic = change[:N_RIGID, N_RIGID:], change[N_RIGID:, :N_RIGID]
    answer, alone = (
        frequency_response(*model, FREQUENCIES)[:, :N_RIGID, ELEVATOR] for model in ((A, B), (A_alone, B_alone))
    )
    moved = np.abs((answer - alone) / scale[:N_RIGID]) ** 2
    return Finding(
        (
            Reading(
                "share of the pitch rate in the rigid equations that the modes enter",
                float(onto_rigid[PITCH_RATE].sum() / onto_rigid.sum()),
                "1",
                at_least=0.5,
            ),
            Reading(
                "share of the pitch rate in what coupling changes of the answer to the elevator, about the modes",
                float(moved[:, PITCH_RATE].sum() / moved.sum()),
                "1",
                at_least=0.5,
            ),
            Reading(
                "share of the pitch rate in what coupling lets the rigid states do to the modes",
                float(onto_elastic[:, PITCH_RATE].sum() / onto_elastic.sum()),
                "1",
                at_least=0.5,
            ),
        ),
        "Shares of squares, states in units of their sizes in the design; mainly: more than half. The modes act on the "
        "rigid body through the pitch acceleration alone; the rigid body acts on them through the pitching moment, in "
        "which there is no pitch rate but the angle of attack.",
    )


def _linearised(vehicle: VehicleParameters) -> tuple[np.ndarray, np.ndarray]:
    point = trim(vehicle, *START)
    return jacobian(point.state, point.input, vehicle)


def peaks(evidence: Evidence) -> Finding:
    """Judge whether peaks are eliminated."""
    section = _section(evidence)
    fall = peak_falls([section])
    at = fall["first"].natural_frequency
    centred = _falls([replace(section, zero_frequency=at, pole_frequency=at)])
    other = _falls(flown_sections(flight_parameters(load_scenario("case1_second_mode_notch"))))
    left = fall["first"].after
    remains = "" if left is None else f" {left.magnitude:.1f} dB are left at {left.frequency:.2f} rad/s."
    return Finding(
        (
            Reading("fall of the first mode's peak", fall["first"].decibel, "dB", at_least=ELIMINATED),
            Reading("fall of the second mode's peak", fall["second"].decibel, "dB", at_least=ELIMINATED),
            Reading(
                "first mode, filter centred at it (unbounded: no peak is left)", centred["first"], "dB", at_least=20.0
            ),
            Reading("second mode, filter centred at it (likewise)", other["second"], "dB", at_least=ELIMINATED),
        ),
        "From the peak before to the highest peak left within a tenth of the mode's frequency; eliminated: a tenth of "
        f"it is left. The design's filter is centred at {section.zero_frequency:g} rad/s, as the poles in the paper's "
        f"Figure 3, beside the first mode at {at:.2f} rad/s:{remains} One filter lowers the second mode's peak, and "
        "does not eliminate it; centred at a mode it leaves no peak of that one.",
        leading=2,
    )


def suppressed(evidence: Evidence) -> Finding:
    """Judge whether the first mode's peak is suppressed."""
    section = _section(evidence)
    changed = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES]
    changed += [replace(section, pole_damping=damping) for damping in POLE_DAMPINGS]
    derived = _falls([_section(evidence, "baseline_derived")], "derived")
    return Finding(
        (
            Reading("fall of the first mode's peak", _falls([section])["first"], "dB", at_least=SUPPRESSED),
            Reading(
                "the same, least over the poles of Figure 3",
                min(_falls([one])["first"] for one in changed),
                "dB",
                at_least=SUPPRESSED,
            ),
            Reading("the same, derived coupling and its filter", derived["first"], "dB", at_least=SUPPRESSED),
        ),
        "Peak to peak; suppressed: less than a third of it is left. See Figures 3 and 5.",
    )


def partially(evidence: Evidence) -> Finding:
    """Judge whether the second mode's peak is decreased, but less."""
    fall = _falls([_section(evidence)])
    derived = _falls([_section(evidence, "baseline_derived")], "derived")
    return Finding(
        (
            Reading("fall of the second mode's peak", fall["second"], "dB", at_least=RAISED),
            Reading("the same: less than the first's", fall["second"], "dB", at_most=fall["first"]),
            Reading("fall, derived coupling and its filter", derived["second"], "dB", at_least=RAISED),
            Reading("the same: less than the first's", derived["second"], "dB", at_most=derived["first"]),
        ),
        f"By the width of the poles, damping {_section(evidence).pole_damping:g}; decreased: by 3 dB, half its power.",
        leading=2,
    )


def unaffected(evidence: Evidence) -> Finding:
    """Judge what the filter does off its centre."""
    section = _section(evidence)
    crossover = margins(evidence, ())[0].frequency
    passed = notch_response([section], np.array([1.0, crossover]))
    loss, lag = -bode(passed)[0], -np.angle(passed)
    return Finding(
        (
            Reading(
                f"phase lag at the rigid body's crossover, {crossover:.1f} rad/s",
                float(lag[1]),
                "rad",
                at_most=UNCHANGED["rad"],
            ),
            Reading("fall of the second mode's peak", _falls([section])["second"], "dB", at_most=RAISED),
            Reading("loss at that crossover", float(loss[1]), "dB", at_most=UNCHANGED["dB"]),
            Reading("loss at 1 rad/s", float(loss[0]), "dB", at_most=UNCHANGED["dB"]),
            Reading("phase lag at 1 rad/s", float(lag[0]), "rad", at_most=UNCHANGED["rad"]),
        ),
        "True of the ideal filter of (37), and for slow signals. A filter wide enough for an uncertain mode takes "
        "phase from the loop below it (unaffected: 5 deg, 0.5 dB); that it lowers the second mode above it (filtered "
        "out: half its power), as the paper says itself of Figure 5, is welcome.",
        leading=2,
    )


def unit_circle(evidence: Evidence) -> Finding:
    """Judge where the zeros of the discrete filter are, and whether it matters."""
    ours, period = _section(evidence), evidence.design("baseline").flown.period
    ideal = replace(ours, zero_damping=0.0)

    def distance(section: NotchSection) -> float:
        data = discretise((section,), period)
        zeros = np.linalg.eigvals(data.A[0] - np.outer(data.B[0], data.C[0]) / data.D[0])
        return float(np.abs(np.abs(zeros) - 1.0).max())

    return Finding(
        (
            Reading("distance of the zeros from the unit circle, epsilon_z = 0", distance(ideal), "1", at_most=1e-6),
            Reading(f"the same, epsilon_z = {ours.zero_damping:g}, ours", distance(ours), "1", at_most=1e-6),
            Reading(
                "by how much more the first mode's peak falls with epsilon_z = 0",
                _falls([ideal])["first"] - _falls([ours])["first"],
                "dB",
                at_least=RAISED,
            ),
        ),
        "Only for a zero numerator damping, epsilon_z = 0, which the paper does not give: then the notch is infinitely "
        f"deep. Ours is {-20.0 * np.log10(ours.zero_damping / ours.pole_damping):.0f} dB deep, and the mode beside its "
        "centre would gain next to nothing from more.",
    )


def poles_match(evidence: Evidence) -> Finding:
    """Judge whether poles and zeros match, and what happens if not."""
    section = _section(evidence)
    far = 10.0 * section.zero_frequency

    def change(one: NotchSection, frequency: float) -> float:
        return float(abs(bode(notch_response([one], np.array([frequency])))[0][0]))

    others = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES if w != section.zero_frequency]
    crossover = margins(evidence, ())[0].frequency
    lag = -float(np.angle(notch_response([section], np.array([crossover])))[0])
    return Finding(
        (
            Reading("change of gain ten times above the notch", change(section, far), "dB", at_most=UNCHANGED["dB"]),
            Reading(
                "change of gain ten times below the notch",
                change(section, 0.1 * section.zero_frequency),
                "dB",
                at_most=UNCHANGED["dB"],
            ),
            Reading(
                "unmatched, with the other pole frequencies of Figure 3: least change of gain above",
                min(change(one, far) for one in others),
                "dB",
                at_least=UNCHANGED["dB"],
            ),
            Reading(
                f"matched, phase lag at the rigid body's crossover, {crossover:.1f} rad/s",
                lag,
                "rad",
                at_most=UNCHANGED["rad"],
            ),
        ),
        f"Poles and zeros of the design's filter have the same frequency, {section.zero_frequency:g} rad/s. They must: "
        "else the gain above the notch is (omega_p / omega_z)^2. Far off the notch nothing changes then, in gain; "
        "phase near it does, whatever matches.",
        leading=3,
    )
