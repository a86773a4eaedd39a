"""The loop and its flights with the notch filter and without: stability, margins, the set, performance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hsv.control.notch_filter import NotchSection
from hsv.design.region import fraction
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.scenario import load_scenario
from hsv.study.claims.claim import Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.disturbances import largest_disturbances
from hsv.study.linear_loop import TARGET, Margin, critical_coupling, phase_margins, sampled_loop, worst_growth
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.vehicle import load_vehicle

WITH, WITHOUT, UNCERTAIN = "case1", "case1_no_notch", "case1_uncertain_no_notch"
DERIVED = "case1_derived"

MARGIN = 1.1
"""What a margin is to bear: the largest uncertainty of a parameter, 10 %."""

CLEARLY = 0.95
"""Times what it was: a change of 5 % can be seen in a figure."""

NO_WORSE = 1.001
"""Times what it was: a difference below a thousandth is none, as in the ranking."""


def without_notch(evidence: Evidence) -> Finding:
    """Judge stability without the notch, and by how much coupling it is there."""
    growth, derived = evidence.growth("paper_like", ()), evidence.growth("derived", ())
    flown = evidence.design("baseline").flown
    share = load_vehicle().coupling_scale("paper_like")
    critical = critical_coupling(flown.feedback_gain, (), flown.period)
    margin = float("inf") if critical is None else critical / share
    uncertain = assemble(flight_parameters(load_scenario(UNCERTAIN))).plant.vehicle
    table = evidence.corners(WITHOUT)
    lost = int(np.count_nonzero(growth > 0.0))
    ringing = worst(table, "elastic_rate_2_ringing") / nominal(table, "elastic_rate_2_ringing")
    return Finding(
        (
            Reading("growth of the loop, nominal, paper-like coupling", float(growth[0]), "1/s", at_most=0.0),
            Reading("critical coupling over the paper-like one", margin, "1", at_least=MARGIN),
            Reading(
                f"growth, parameters of `{UNCERTAIN}`",
                worst_growth(uncertain, flown.feedback_gain, (), flown.period),
                "1/s",
                at_most=0.0,
            ),
            Reading("growth, worst corner, paper-like coupling", float(growth.max()), "1/s", at_most=0.0),
            Reading("growth, nominal, derived coupling", float(derived[0]), "1/s", at_most=0.0),
        ),
        f"The paper-like coupling, {share:g} times the derived one, was chosen so that the nominal vehicle is stable, "
        f"and it is only just: from {share * margin:.4f} times on, {100.0 * (margin - 1.0):.1f} % more coupling, it is "
        f"not ({MARGIN:g}: what the largest uncertainty of a parameter, 10 %, asks for). Without the notch "
        f"{lost} of {len(growth)} vehicles are unstable, most of them slowly (second-mode ringing in flight at worst "
        f"{ringing:.1f} times the nominal). The stability proof is one of the decoupled model.",
    )


def not_destroyed(evidence: Evidence) -> Finding:
    """Judge stability with the notch."""
    flown, other = evidence.design("baseline").flown, evidence.design("baseline_derived").flown
    like, derived = evidence.growth("paper_like", flown.notch), evidence.growth("derived", flown.notch)
    retuned = evidence.growth("derived", other.notch, "baseline_derived")
    what = "growth, worst corner, derived coupling, notch at {:g} rad/s"
    return Finding(
        (
            Reading("growth, nominal, paper-like coupling", float(like[0]), "1/s", at_most=0.0),
            Reading("growth, worst corner, paper-like coupling", float(like.max()), "1/s", at_most=0.0),
            Reading(what.format(flown.notch[0].zero_frequency), float(derived.max()), "1/s", at_most=0.0),
            Reading(what.format(other.notch[0].zero_frequency), float(retuned.max()), "1/s", at_most=0.0),
        ),
        "More than not destroyed: with the paper-like coupling the filter makes every vehicle stable, also those that "
        "are not without it. What a reasonable choice is depends on the coupling.",
        leading=2,
    )


def margins(
    evidence: Evidence,
    notch: tuple[NotchSection, ...],
    vehicle: VehicleParameters | None = None,
    design: str = "baseline",
) -> list[Margin]:
    """Return the margins of the loop broken at the elevator, the slowest crossover, the rigid body's, first.

    Those of a loop that is not stable are negative. ``vehicle``: paper-like and nominal unless given.
    """
    flown = evidence.design(design).flown
    # Fine about the modes, where the gain just touches one.
    top = 0.95 * np.pi / flown.period
    frequencies = np.unique(np.concatenate((np.geomspace(0.1, top, 3000), np.linspace(12.0, 22.0, 5001))))
    loop = sampled_loop(
        vehicle or load_vehicle().coupled("paper_like"), flown.feedback_gain, notch, flown.period, point=TARGET
    )
    sign = 1.0 if loop.growth < 0.0 else -1.0
    found = phase_margins(frequencies, loop.elevator_loop(frequencies))
    return sorted((replace(m, phase=sign * m.phase) for m in found), key=lambda margin: margin.frequency)


def _smallest(margins: list[Margin]) -> float:
    return min(margin.phase for margin in margins)


def phase_margin(evidence: Evidence) -> Finding:
    """Judge what the notch does to the phase margins of the loop broken at the elevator."""
    notch = evidence.design("baseline").flown.notch
    without, with_notch = margins(evidence, ()), margins(evidence, notch)
    vehicles = [load_vehicle().coupled("paper_like").perturbed(corner) for corner in evidence.over]
    gained, rigid = (
        np.array(found)
        for found in zip(
            *((_smallest(b) - _smallest(a), b[0].phase - abs(a[0].phase)) for a, b in _pairs(evidence, vehicles)),
            strict=True,
        )
    )
    derived = load_vehicle().coupled("derived")
    retuned = margins(evidence, evidence.design("baseline_derived").flown.notch, derived, "baseline_derived")
    at_derived = _smallest(retuned) - _smallest(margins(evidence, (), derived))
    before = _smallest(without)
    return Finding(
        (
            Reading("gain of the smallest margin of all crossovers, nominal", float(gained[0]), "rad", at_least=0.0),
            Reading("the same, worst corner", float(gained.min()), "rad", at_least=0.0),
            Reading("the same, nominal, derived coupling and its filter", at_derived, "rad", at_least=0.0),
            Reading("gain of the margin at the rigid body's crossover, nominal", float(rigid[0]), "rad", at_least=0.0),
        ),
        "Loop broken at the elevator; the margin of a loop that is not stable counts as negative. Without the notch "
        f"the second mode crosses unit gain with {np.degrees(before):.1f} deg left; the notch removes that crossing. "
        f"At the rigid body's own crossover, {without[0].frequency:.1f} rad/s, it costs phase: "
        f"{np.degrees(without[0].phase):.0f} deg before, {np.degrees(with_notch[0].phase):.0f} deg after, at "
        f"{with_notch[0].frequency:.1f} rad/s. That is all it does for the {int(np.count_nonzero(gained < 0.0))} of "
        f"{len(gained)} vehicles whose second mode stays below unit gain.",
    )


def _pairs(evidence: Evidence, vehicles: Sequence[VehicleParameters]) -> list[tuple[list[Margin], list[Margin]]]:
    """Return the margins of each vehicle without and with the filter."""
    notch = evidence.design("baseline").flown.notch
    return [(margins(evidence, (), vehicle), margins(evidence, notch, vehicle)) for vehicle in vehicles]


def less_uncertainty(evidence: Evidence) -> Finding:
    """Judge whether the lumped disturbance is smaller with the notch."""
    over = [corner for corner in fraction(load_vehicle().uncertainty) if corner in evidence.over]
    a, b = (largest_disturbances(scenario, over) for scenario in (WITH, WITHOUT))

    def bound(channel: str) -> float:
        return float(a[channel].max() / b[channel].max())

    pitch = "pitch_acceleration"
    return Finding(
        (
            Reading(
                "largest disturbance in pitch acceleration, with over without notch, nominal",
                float(a[pitch][0] / b[pitch][0]),
                "1",
                at_most=CLEARLY,
            ),
            Reading("its bound over the corners, with over without notch", bound(pitch), "1", at_most=CLEARLY),
            Reading("the same in acceleration", bound("acceleration"), "1", at_most=CLEARLY),
            Reading("the same in lost elevator", bound("lost_elevator"), "1", at_most=CLEARLY),
        ),
        f"The lumped disturbance as it acted in flight, {len(over)} of the vehicles (those that W is measured on); "
        "reduced: by 5 % or more. What vibration adds to the pitch acceleration falls, so in that channel filtering "
        "leaves a smaller disturbance. The parameters stay as uncertain as they were: what a wrong mass or thrust does "
        "to the acceleration is the same.",
    )


def still_in_the_set(evidence: Evidence) -> Finding:
    """Judge whether flights with the notch keep to the set."""
    like, derived = evidence.spread(WITH, "tube_level"), evidence.corners(DERIVED)
    return Finding(
        (
            *like.readings("worst level of a flight with the notch", "1", at_most=1.0),
            Reading("the same, derived coupling", worst(derived, "tube_level"), "1", at_most=1.0),
        ),
        f"Of {evidence.vehicles} vehicles. The set was computed with the filter in the loop, its states among it; the "
        "paper's reason, that filtering reduces uncertainty, is not needed for it.",
        leading=3,
    )


def closer(evidence: Evidence) -> Finding:
    """Judge whether errors from the nominal trajectory are smaller with the notch."""
    whole, rate = (
        evidence.spread(WITH, name).over(evidence.spread(WITHOUT, name)) for name in ("rigid_error", "pitch_rate_error")
    )
    return Finding(
        (
            *whole.readings("rigid error with over without notch", "1", at_most=1.0, first="nominal"),
            *rate.readings("pitch-rate error with over without notch", "1", at_most=1.0, first="nominal"),
            Reading("rigid error, closer by 5 % or more: the first number", whole.nominal, "1", at_most=CLEARLY),
        ),
        "Root mean square over the 20 s after the fault, states over the half-widths of the set. Closer, but not so "
        f"that one would see it: by {100.0 * (1.0 - whole.nominal):.1f} % for the nominal vehicle, in pitch rate by "
        f"{100.0 * (1.0 - rate.nominal):.1f} %. The notch changes the vibration and little else; what separates "
        "the vehicle from its nominal trajectory are fault and parameters.",
    )


def better(evidence: Evidence) -> Finding:
    """Judge vibration, attitude and altitude with the notch against those without."""
    decay, attitude, end, largest = (
        evidence.spread(WITH, name).over(evidence.spread(WITHOUT, name))
        for name in (
            "elastic_settling_time",
            "post_fault_attitude_deviation",
            "altitude_end_error",
            "post_fault_altitude_error",
        )
    )
    ringing = int(np.count_nonzero(np.isinf(evidence.corners(WITHOUT)["elastic_settling_time"])))
    return Finding(
        (
            *decay.readings("decay time with over without", "1", at_most=1.0, first="nominal"),
            *attitude.readings("post-fault attitude with over without", "1", at_most=1.0, first="nominal"),
            *end.readings("altitude error at the end with over without", "1", at_most=NO_WORSE, first="nominal"),
            *largest.readings(
                "largest altitude error after the fault with over without", "1", at_most=NO_WORSE, first="nominal"
            ),
        ),
        f"Vibration decays sooner by far: without the notch it never does, by the end, for {ringing} of "
        f"{evidence.vehicles} vehicles, which count as a ratio of zero. Attitude moves a little less; altitude is held "
        "no better. A difference of a thousandth is none.",
    )
