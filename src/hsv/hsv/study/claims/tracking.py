"""Claims of section 5.2 on how Case 1 is tracked, by the tube and by robust MPC."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.claim import Claim, Finding, Reading, shown
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.claims.thresholds import A_LOT, ALTITUDE_BAND, SOON, VELOCITY_BAND
from hsv.study.linear_loop import critical_coupling
from hsv.vehicle.vehicle import load_vehicle

TUBE, DERIVED, TUBE_DM = "case1", "case1_derived", "case1_tube_dm"
RMPC, FAMILY = "case1_rmpc", "case1_rmpc_fourth_k"
COUPLED, DERIVED_COUPLING = ("vehicle.model", "CM"), ("vehicle.coupling", "derived")
FLOWN_GAIN = 3
"""Index, in the nested family, of the gain that ``case1_rmpc_fourth_k`` flies."""


def gains(evidence: Evidence) -> int:
    """Return how many gains the baseline's nested family has."""
    return len(evidence.design("baseline").flown.nominal_gains)


def losses(evidence: Evidence) -> dict[int, int]:
    """Return how many vehicles robust MPC loses by gain, from the last of the family to the first that loses none."""
    lost = {}
    for index in reversed(range(gains(evidence))):
        changes = () if index == FLOWN_GAIN else (("robust_mpc.gain_index", index),)
        lost[index] = int(evidence.corners(FAMILY, *changes)["diverged"].sum())
        if not lost[index]:
            break
    return lost


def _rmpc_flexible(evidence: Evidence) -> Finding:
    coupled, alone = (evidence.spread(RMPC, "altitude_end_error", *c) for c in ((COUPLED,), ()))
    count = gains(evidence)
    last, last_alone = (evidence.changed(FAMILY, ("robust_mpc.gain_index", count - 1), *c) for c in ((COUPLED,), ()))
    derived = [
        evidence.changed(FAMILY, ("robust_mpc.gain_index", index), COUPLED, DERIVED_COUPLING) for index in range(count)
    ]
    lost = int(sum(flight["diverged"] for flight in derived))
    family, paper_like = evidence.design("baseline").flown, load_vehicle().coupling_scale("paper_like")
    limits = [critical_coupling(family.nominal_gains[index], (), family.period) for index in (0, count - 1)]
    ratio = coupled.over(alone)
    return Finding(
        (
            *coupled.readings(
                "altitude error at the end on the coupled model, single gain", "m", at_least=ALTITUDE_BAND
            ),
            Reading(
                f"of {count} gains, those that lose it with the derived coupling",
                float(lost),
                "1",
                at_least=float(count),
            ),
            *ratio.readings("altitude error on the coupled over that on the decoupled model", "1", at_least=A_LOT)[:2],
            Reading(
                "decay of the elastic rates on the coupled model, last gain, nominal vehicle",
                last["elastic_settling_time"],
                "s",
                at_least=SOON,
            ),
        ),
        "With the paper-like coupling it is not flexibility: with the single gain the altitude is off by "
        f"{shown(alone.nominal, 'm')} on the decoupled model too. It is with a stiffer gain: the last ends "
        f"{shown(abs(last['altitude_end_error']), 'm')} off, and its elastic rates decay in "
        f"{shown(last['elastic_settling_time'], 's')}, on the decoupled model in "
        f"{shown(last_alone['elastic_settling_time'], 's')}. With the derived coupling {lost} of {count} gains lose "
        f"the vehicle: the loop is stable up to {_limit(limits[0])} of that coupling with the single gain, up to "
        f"{_limit(limits[1])} with the last, and the paper-like one is {paper_like:g} of it.",
    )


def _limit(kappa: float | None) -> str:
    return "any share studied" if kappa is None else f"{kappa:.3f}"


def _tracks(evidence: Evidence) -> Finding:
    table, derived = evidence.corners(TUBE), evidence.corners(DERIVED)
    lost, error = (evidence.spread(TUBE, measure) for measure in ("diverged", "post_fault_altitude_error"))
    first, *others = error.readings("largest altitude error after the fault", "m", at_most=ALTITUDE_BAND)
    beyond = int(np.count_nonzero(~(error.vehicles <= ALTITUDE_BAND)))
    return Finding(
        (
            Reading("flight lost (1: yes), uncertain parameters", lost.uncertain, "1", at_most=0.0),
            first,
            *others,
            Reading(f"flights lost of {evidence.vehicles}", float(table["diverged"].sum()), "1", at_most=0.0),
            Reading("the same, derived coupling", float(derived["diverged"].sum()), "1", at_most=0.0),
            Reading(
                "largest altitude error, derived coupling, worst corner",
                worst(derived, "post_fault_altitude_error"),
                "m",
                at_most=ALTITUDE_BAND,
            ),
        ),
        f"Without integral action an offset stays: {beyond} of {evidence.vehicles} vehicles are farther off than the "
        "band of an accurate response.",
        leading=2,
    )


def _rmpc_altitude(evidence: Evidence) -> Finding:
    single, fourth = evidence.spread(RMPC, "altitude_end_error"), evidence.spread(FAMILY, "altitude_end_error")
    tube, count = evidence.changed(TUBE_DM), gains(evidence)
    last = evidence.changed(FAMILY, ("robust_mpc.gain_index", count - 1))
    lost = losses(evidence)
    tightest = min(lost)
    return Finding(
        (
            *single.readings("altitude error at the end, single gain", "m", at_least=ALTITUDE_BAND),
            *fourth.readings("altitude error at the end, fourth gain", "m", at_least=ALTITUDE_BAND),
            Reading(
                "altitude error at the end, last gain, nominal vehicle",
                abs(last["altitude_end_error"]),
                "m",
                at_least=ALTITUDE_BAND,
            ),
        ),
        "Decoupled model, as in the paper; the tube with the single gain ends "
        f"{shown(abs(tube['altitude_end_error']), 'm')} off there. The size of the error is the size of the gain, "
        f"which the paper does not give: of {count} nested gains number {tightest + 1} is the tightest that "
        f"{_survival(lost, tightest, evidence.vehicles)}; the last leaves "
        f"{shown(abs(last['altitude_end_error']), 'm')} and limits inputs in {last['saturated_steps']:.0f} steps.",
    )


def _survival(lost: dict[int, int], tightest: int, vehicles: int) -> str:
    if lost[tightest]:
        return f"was flown, and loses {lost[tightest]} of {vehicles} vehicles"
    tighter = ", ".join(f"number {index + 1} loses {count}" for index, count in lost.items() if count)
    return f"loses none of {vehicles} vehicles" + (f" ({tighter})" if tighter else "")


def _accurate(evidence: Evidence) -> Finding:
    altitude, velocity = (evidence.spread(TUBE, f"{name}_end_error") for name in ("altitude", "velocity"))
    derived = evidence.corners(DERIVED)
    h = altitude.readings("altitude error at the end", "m", at_most=ALTITUDE_BAND)
    v = velocity.readings("velocity error at the end", "m/s", at_most=VELOCITY_BAND)
    beyond = int(np.count_nonzero(altitude.vehicles > ALTITUDE_BAND))
    return Finding(
        (
            h[0],
            v[0],
            *h[1:],
            *v[1:],
            Reading(
                "altitude, derived coupling, nominal vehicle",
                abs(nominal(derived, "altitude_end_error")),
                "m",
                at_most=ALTITUDE_BAND,
            ),
        ),
        f"{beyond} of {evidence.vehicles} vehicles end farther from the altitude than the band: nothing integrates "
        "the error.",
        leading=2,
    )


def _stable(evidence: Evidence) -> Finding:
    table, derived = evidence.corners(TUBE), evidence.corners(DERIVED)
    lost = evidence.spread(TUBE, "diverged")
    growth = evidence.growth("paper_like", evidence.design("baseline").flown.notch)
    own = evidence.growth("derived", evidence.design("baseline_derived").flown.notch, "baseline_derived")
    other = evidence.growth("derived", evidence.design("baseline").flown.notch)
    return Finding(
        (
            Reading("flight lost (1: yes), uncertain parameters", lost.uncertain, "1", at_most=0.0),
            Reading(f"flights lost of {evidence.vehicles}", float(table["diverged"].sum()), "1", at_most=0.0),
            Reading("growth of the linear loop, worst corner", float(growth.max()), "1/s", at_most=0.0),
            Reading(
                "flights lost, derived coupling and its own filter", float(derived["diverged"].sum()), "1", at_most=0.0
            ),
            Reading("growth of that loop, worst corner", float(own.max()), "1/s", at_most=0.0),
            Reading("growth, derived coupling, the other filter, worst corner", float(other.max()), "1/s", at_most=0.0),
        ),
        "Growth: largest real part of the loop's poles. The filter has to be tuned to the coupling: that of the "
        f"paper-like one leaves {np.count_nonzero(other > 0.0)} of {evidence.vehicles} loops unstable with the derived "
        "coupling.",
    )


_SUMMARY = (
    "Simulation results show that the Tube-MPC with notch filter can realize accurate and stable trajectory tracking "
    "in presence of uncertain parameters and actuator loss of effectiveness fault."
)

CLAIMS = (
    Claim(
        "RMPC needs the decoupled model",
        "It is worth noting that the traditional RMPC cannot achieve satisfactory result in the presence of "
        "flexibility.",
        "5.2",
        _rmpc_flexible,
    ),
    Claim(
        "tracking through the fault",
        "After fault happens, the flexible hypersonic vehicle can still track the reference trajectory stably using "
        "Tube-MPC.",
        "5.2, Figure 9",
        _tracks,
    ),
    Claim(
        "RMPC cannot track altitude",
        "However, the accurate altitude tracking is not achieved by the traditional RMPC.",
        "5.2, Figure 9",
        _rmpc_altitude,
    ),
    Claim("accurate tracking", _SUMMARY, "5.2", _accurate),
    Claim("stable tracking", _SUMMARY, "5.2", _stable),
)
