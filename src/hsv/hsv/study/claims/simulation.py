"""Claims of section 5.2 on Case 1."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.units import to_paper
from hsv.vehicle.envelope import FOOT, INPUT_MAXIMUM, INPUT_MINIMUM

TUBE, WITHOUT, DERIVED = "case1", "case1_no_notch", "case1_derived"
RMPC, RMPC_FOURTH, TUBE_DM = "case1_rmpc", "case1_rmpc_fourth_k", "case1_tube_dm"
HALF_DEGREE = float(np.radians(0.5))


def _tracks(evidence: Evidence) -> Finding:
    table = evidence.corners(TUBE)
    lost = float(table["diverged"].sum())
    return Finding(
        (
            Reading("flights lost of 1025", lost, "1", at_most=0.0),
            Reading(
                "altitude error at the end, nominal", abs(nominal(table, "altitude_end_error")), "m", at_most=8.0 * FOOT
            ),
            Reading(
                "altitude error at the end, worst corner", worst(table, "altitude_end_error"), "m", at_most=25.0 * FOOT
            ),
            Reading(
                "velocity error at the end, worst corner", worst(table, "velocity_end_error"), "m/s", at_most=5.0 * FOOT
            ),
        ),
        "An offset of a few feet stays: no integral action.",
    )


def _rmpc_altitude(evidence: Evidence) -> Finding:
    single, fourth = evidence.corners(RMPC), evidence.corners(RMPC_FOURTH)
    tube = evidence.changed(TUBE_DM)
    uncertain = evidence.changed("case1_uncertain_rmpc_fourth_k", ("robust_mpc.gain_index", -1))
    last = evidence.changed(RMPC_FOURTH, ("robust_mpc.gain_index", -1))
    gains = np.abs(fourth["altitude_end_error"])
    return Finding(
        (
            Reading(
                "altitude error at the end, single gain, nominal",
                abs(nominal(single, "altitude_end_error")),
                "m",
                at_least=100.0 * FOOT,
            ),
            Reading(
                "the same, best corner", float(np.abs(single["altitude_end_error"]).min()), "m", at_least=100.0 * FOOT
            ),
            Reading(
                "altitude error at the end, fourth gain, nominal",
                abs(nominal(fourth, "altitude_end_error")),
                "m",
                at_least=100.0 * FOOT,
            ),
            Reading(
                "altitude error at the end, last gain, nominal",
                abs(last["altitude_end_error"]),
                "m",
                at_least=100.0 * FOOT,
            ),
        ),
        "Decoupled model, as in the paper; the tube with the single gain ends "
        f"{_feet(abs(tube['altitude_end_error'])):.1f} ft off there. The size of the error is the size of "
        "the gain, which the paper does not give: the last gain of the family leaves "
        f"{_feet(abs(last['altitude_end_error'])):.0f} ft, limits inputs in {last['saturated_steps']:.0f} steps and "
        f"{'is lost' if uncertain['diverged'] else 'stays up'} with the parameters of `case1_uncertain`; the fourth "
        f"leaves {_feet(float(gains.min())):.0f} ft to "
        f"{_feet(float(gains.max())):.0f} ft over the corners.",
    )


def _soon(evidence: Evidence) -> Finding:
    table = evidence.corners(TUBE)
    return Finding(
        (
            Reading(
                "time until attitude stays within 0.06 deg of its end, nominal",
                nominal(table, "attitude_settling_time"),
                "s",
                at_most=10.0,
            ),
            Reading("the same, worst corner", worst(table, "attitude_settling_time"), "s", at_most=10.0),
        ),
        "Attitude settles at the new equilibrium.",
    )


def _smaller_than_rmpc(evidence: Evidence) -> Finding:
    tube, fourth, single = (evidence.corners(name) for name in (TUBE, RMPC_FOURTH, RMPC))
    name = "post_fault_attitude_deviation"
    return Finding(
        (
            Reading(
                "attitude excursion over that of RMPC (fourth gain), nominal",
                nominal(tube, name) / nominal(fourth, name),
                "1",
                at_most=1.0,
            ),
            Reading("the same, worst corners", worst(tube, name) / worst(fourth, name), "1", at_most=1.0),
            Reading(
                "over that of RMPC (single gain), nominal",
                nominal(tube, name) / nominal(single, name),
                "1",
                at_most=1.0,
            ),
        ),
        f"{_degrees(nominal(tube, name)):.2f} deg with the tube, {_degrees(nominal(fourth, name)):.2f} deg and "
        f"{_degrees(nominal(single, name)):.2f} deg with robust MPC.",
    )


def _gentler(evidence: Evidence) -> Finding:
    a, b = evidence.corners(TUBE), evidence.corners(WITHOUT)
    ratio = a["pitch_rate_ringing"] / b["pitch_rate_ringing"]
    return Finding(
        (
            Reading(
                "pitch-rate ringing 10 s to 20 s after the fault, with over without notch, nominal",
                float(ratio[0]),
                "1",
                at_most=0.5,
            ),
            Reading("the same, worst corner", float(ratio.max()), "1", at_most=0.5),
            Reading(
                "attitude excursion with over without notch, nominal",
                nominal(a, "post_fault_attitude_deviation") / nominal(b, "post_fault_attitude_deviation"),
                "1",
                at_most=1.0,
            ),
        ),
        "The excursion itself is the fault's; what rings afterwards is what the notch takes away.",
    )


def _elastic_return(evidence: Evidence) -> Finding:
    a, b, d = (evidence.corners(name) for name in (TUBE, WITHOUT, DERIVED))
    return Finding(
        (
            Reading("decay time with notch, nominal", nominal(a, "elastic_decay_time"), "s", at_most=12.0),
            Reading("decay time with notch, worst corner", worst(a, "elastic_decay_time"), "s", at_most=12.0),
            Reading(
                "decay time with notch, derived coupling, worst corner",
                worst(d, "elastic_decay_time"),
                "s",
                at_most=16.0,
            ),
            Reading("decay time without notch, nominal", nominal(b, "elastic_decay_time"), "s", at_most=20.0),
        ),
        "Time until both rates stay within 5 % of their peak after the fault. Soon with the notch, not without.",
    )


def _rmpc_vibrates(evidence: Evidence) -> Finding:
    tube, fourth, single = (evidence.corners(name) for name in (TUBE, RMPC_FOURTH, RMPC))

    def ratio(table: dict[str, np.ndarray], name: str) -> float:
        return nominal(table, name) / nominal(tube, name)

    return Finding(
        (
            Reading(
                "span of the first coordinate, RMPC over tube",
                ratio(fourth, "elastic_coordinate_1_span"),
                "1",
                at_least=1.5,
            ),
            Reading(
                "span of the second coordinate, RMPC over tube",
                ratio(fourth, "elastic_coordinate_2_span"),
                "1",
                at_least=1.5,
            ),
            Reading("span of the first rate, RMPC over tube", ratio(fourth, "elastic_rate_1_span"), "1", at_least=1.5),
            Reading("span of the second rate, RMPC over tube", ratio(fourth, "elastic_rate_2_span"), "1", at_least=1.5),
            Reading(
                "span of the second rate, RMPC with the single gain over tube",
                ratio(single, "elastic_rate_2_span"),
                "1",
                at_least=1.5,
            ),
        ),
        "The coordinates follow the larger swing of the angle of attack; that is not vibration. Their rates move no "
        "more: in the decoupled model, which robust MPC flies in the paper too, nothing feeds vibration back.",
    )


def _jitter(evidence: Evidence) -> Finding:
    a, b = evidence.corners(TUBE), evidence.corners(WITHOUT)
    first, second = (a[f"elastic_rate_{m}_ringing"] / b[f"elastic_rate_{m}_ringing"] for m in (1, 2))
    return Finding(
        (
            Reading("ringing of the first rate, with over without notch, nominal", float(first[0]), "1", at_most=0.5),
            Reading("the same, worst corner", float(first.max()), "1", at_most=0.5),
            Reading("ringing of the second rate, with over without notch, nominal", float(second[0]), "1", at_most=0.5),
            Reading("the same, worst corner", float(second.max()), "1", at_most=0.5),
        ),
        "Span between 10 s and 20 s after the fault.",
    )


def _inputs(evidence: Evidence) -> Finding:
    table, derived = evidence.corners(TUBE), evidence.corners(DERIVED)
    fuel = table["fuel_equivalence_ratio_minimum"].min(), table["fuel_equivalence_ratio_maximum"].max()
    elevator = table["elevator_deflection_minimum"].min(), table["elevator_deflection_maximum"].max()
    return Finding(
        (
            Reading("least fuel ratio, 1025 flights", float(fuel[0]), "1", at_least=float(INPUT_MINIMUM[0])),
            Reading("largest fuel ratio", float(fuel[1]), "1", at_most=float(INPUT_MAXIMUM[0])),
            Reading("least elevator", float(elevator[0]), "rad", at_least=float(INPUT_MINIMUM[1])),
            Reading("largest elevator", float(elevator[1]), "rad", at_most=float(INPUT_MAXIMUM[1])),
            Reading("most limited steps of a flight", worst(table, "saturated_steps"), "1", at_most=0.0),
            Reading("the same, derived coupling", worst(derived, "saturated_steps"), "1", at_most=0.0),
        ),
        "Far from the limits, and never limited by force.",
    )


def _second_mode(evidence: Evidence) -> Finding:
    without, with_second = evidence.corners(WITHOUT), evidence.changed("case1_second_mode_notch")
    first, second = (
        with_second[f"elastic_rate_{mode}_decay_time"] / nominal(without, f"elastic_rate_{mode}_decay_time")
        for mode in (1, 2)
    )
    return Finding(
        (
            Reading("decay of the second rate, with over without", second, "1", at_most=0.5),
            Reading("decay of the first rate, with over without", first, "1", at_most=1.0),
            Reading("the effect on the first is slight", first, "1", at_least=0.75),
        ),
        "The filter at the second mode is wide enough to take the destabilising feedback from both.",
    )


def _accurate(evidence: Evidence) -> Finding:
    table = evidence.corners(TUBE)
    step = (600.0 * FOOT, 250.0 * FOOT)
    return Finding(
        (
            Reading(
                "altitude error at the end over the step, nominal",
                abs(nominal(table, "altitude_end_error")) / step[0],
                "1",
                at_most=0.02,
            ),
            Reading(
                "velocity error at the end over the step, nominal",
                abs(nominal(table, "velocity_end_error")) / step[1],
                "1",
                at_most=0.02,
            ),
            Reading("flights lost of 1025", float(table["diverged"].sum()), "1", at_most=0.0),
            Reading("altitude, worst corner", worst(table, "altitude_end_error") / step[0], "1", at_most=0.02),
            Reading("velocity, worst corner", worst(table, "velocity_end_error") / step[1], "1", at_most=0.02),
        ),
        "2 % of the step is the usual band of a settled response. Stable everywhere; accurate for the nominal "
        "vehicle, and in altitude not at the corners, where mass and thrust are off.",
    )


def _attitude_own_mean(evidence: Evidence) -> Finding:
    return _attitude(
        evidence, "post_fault_attitude_deviation", "Change after the fault from the mean of the 5 s before it."
    )


def _attitude_nominal(evidence: Evidence) -> Finding:
    return _attitude(
        evidence,
        "post_fault_attitude_from_nominal",
        "Distance from reference and nominal trajectory, after the fault; most of it is the trim of a wrong mass.",
    )


def _attitude_whole(evidence: Evidence) -> Finding:
    return _attitude(
        evidence,
        "attitude_from_nominal",
        "Distance from reference and nominal trajectory from t = 0: perturbed vehicles start away from their own trim.",
    )


def _attitude_reference(evidence: Evidence) -> Finding:
    return _attitude(
        evidence,
        "attitude_from_reference",
        "Distance from the commanded equilibrium over the whole flight: the manoeuvre itself needs more than half a "
        "degree.",
    )


def _attitude_certified(evidence: Evidence) -> Finding:
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


def _attitude(evidence: Evidence, name: str, why: str) -> Finding:
    table, derived = evidence.corners(TUBE), evidence.corners(DERIVED)
    return Finding(
        (
            Reading("nominal", nominal(table, name), "rad", at_most=HALF_DEGREE),
            Reading("worst corner", worst(table, name), "rad", at_most=HALF_DEGREE),
            Reading("worst corner, derived coupling", worst(derived, name), "rad", at_most=HALF_DEGREE),
        ),
        why,
    )


def _rejected_paper_like(evidence: Evidence) -> Finding:
    a, b = evidence.corners(TUBE), evidence.corners(WITHOUT)
    return Finding(
        (
            Reading("decay without notch, nominal", nominal(b, "elastic_decay_time"), "s", at_least=20.0),
            Reading("flights lost without notch, of 1025", float(b["diverged"].sum()), "1", at_most=0.0),
            Reading("decay with notch, nominal", nominal(a, "elastic_decay_time"), "s", at_most=12.0),
            Reading("decay with notch, worst corner", worst(a, "elastic_decay_time"), "s", at_most=12.0),
        ),
        "With the paper-like coupling flights without notch come to their end, ringing; with it the modes decay.",
    )


def _rejected_derived(evidence: Evidence) -> Finding:
    without, with_notch = evidence.changed("case1_derived_no_notch"), evidence.corners(DERIVED)
    section = evidence.design("baseline_derived").flown.notch[0]
    growth = evidence.growth("derived", evidence.design("baseline").flown.notch)
    unstable = int(np.count_nonzero(growth > 0.0))
    return Finding(
        (
            Reading("the flight without notch diverges (1: yes)", without["diverged"], "1", at_least=1.0),
            Reading("decay with notch, nominal", nominal(with_notch, "elastic_decay_time"), "s", at_most=16.0),
            Reading("decay with notch, worst corner", worst(with_notch, "elastic_decay_time"), "s", at_most=16.0),
        ),
        f"Without the notch the flight is lost at {without['end_time']:.1f} s: with this coupling the notch is not an "
        f"improvement but what makes flight possible. It is at {section.zero_frequency:g} rad/s and wider here; the "
        "one "
        f"at 15 rad/s leaves {unstable} of {len(growth)} vehicles unstable.",
    )


def _rmpc_flexible(evidence: Evidence) -> Finding:
    decoupled = abs(nominal(evidence.corners(RMPC_FOURTH), "altitude_end_error"))
    single = evidence.changed(RMPC, ("vehicle.model", "CM"))
    fourth = evidence.changed(RMPC_FOURTH, ("vehicle.model", "CM"))
    bare = evidence.changed(RMPC_FOURTH, ("vehicle.model", "CM"), ("notch.enabled", False))
    errors = [abs(flown["altitude_end_error"]) for flown in (single, fourth, bare)]
    return Finding(
        (
            Reading("altitude error at the end on the CM, single gain", errors[0], "m", at_least=100.0 * FOOT),
            Reading("altitude error at the end on the CM, fourth gain", errors[1], "m", at_least=100.0 * FOOT),
            Reading("the same without notch filter", errors[2], "m", at_least=100.0 * FOOT),
            Reading("error on the CM over that on the DM, fourth gain", errors[1] / decoupled, "1", at_least=1.5),
            Reading("the same without notch filter", errors[2] / decoupled, "1", at_least=1.5),
        ),
        f"Not satisfactory, but not for its flexibility: the fourth gain ends {_feet(errors[1]):.0f} ft off on the "
        f"coupled model, {_feet(errors[2]):.0f} ft without notch filter, {_feet(decoupled):.0f} ft on the decoupled "
        "model. What it is off by comes with the fault, on either model.",
    )


def _feet(value: float) -> float:
    return to_paper(value, "m")[0]


def _degrees(value: float) -> float:
    return to_paper(value, "rad")[0]


_ATTITUDE = "The dynamic error of the longitudinal attitude angles is within ±0.5°."
_REJECTED = "By introducing notch filter, the flexible modes can be rejected."

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
    Claim(
        "elastic coordinates return",
        "They vibrate after fault occurs, but soon return to stability.",
        "5.2, Figure 11",
        _elastic_return,
    ),
    Claim(
        "RMPC vibrates a lot more",
        "Similarly, using the traditional RMPC control, they vibrate a lot more.",
        "5.2, Figure 11",
        _rmpc_vibrates,
    ),
    Claim(
        "jitter",
        "The jitter of the system under Tube-MPC with notch filter is gentler and smoother.",
        "5.2, Figure 11",
        _jitter,
    ),
    Claim(
        "inputs satisfy the constraints",
        "It can be seen that control inputs satisfy the input constraints in presence of fault.",
        "5.2, Figure 12",
        _inputs,
    ),
    Claim(
        "notch at the second mode",
        "It can be known that the notch filter has a slight inhibition on the derivative of the first-order flexible "
        "mode, and a significant impact on the derivative of the second-order flexible mode.",
        "5.2, Figure 13",
        _second_mode,
    ),
    Claim(
        "accurate and stable",
        "Simulation results show that the Tube-MPC with notch filter can realize accurate and stable trajectory "
        "tracking in presence of uncertain parameters and actuator loss of effectiveness fault.",
        "5.2",
        _accurate,
    ),
    Claim("±0.5°: change after the fault", _ATTITUDE, "5.2", _attitude_own_mean),
    Claim("±0.5°: from nominal after the fault", _ATTITUDE, "5.2", _attitude_nominal),
    Claim("±0.5°: from nominal, whole flight", _ATTITUDE, "5.2", _attitude_whole),
    Claim("±0.5°: from the command, whole flight", _ATTITUDE, "5.2", _attitude_reference),
    Claim("±0.5°: guaranteed by the set", _ATTITUDE, "5.2", _attitude_certified),
    Claim("modes rejected, paper-like coupling", _REJECTED, "5.2", _rejected_paper_like),
    Claim("modes rejected, derived coupling", _REJECTED, "5.2", _rejected_derived),
)
