"""Claims of section 3.1 and 5.1: the polytopic model and the disturbances."""

from __future__ import annotations

import numpy as np

from hsv.lpv.frequency import bode
from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence
from hsv.study.figures.bode import peak, pitch_rate_response
from hsv.study.linear_loop import START
from hsv.vehicle.dynamics import jacobian
from hsv.vehicle.modes import Mode, modes
from hsv.vehicle.parameters import vehicle_parameters
from hsv.vehicle.trim import trim

ELASTIC_PEAKS = {"first": (14.0, 17.5), "second": (18.5, 21.0)}
"""Between which frequencies (rad/s) the peaks of the modes are, paper-like coupling."""


def open_loop_modes(coupling: str) -> list[Mode]:
    """Return the modes of the coupled model where Case 1 starts, fastest first."""
    vehicle = vehicle_parameters(coupling)
    point = trim(vehicle, *START)
    return modes(jacobian(point.state, point.input, vehicle)[0])


def shift(coupling: str) -> float:
    """Return the largest relative distance of a coupled elastic mode from its structural frequency."""
    vehicle = vehicle_parameters(coupling)
    structural = (vehicle.natural_frequency_2, vehicle.natural_frequency_1)
    elastic = open_loop_modes(coupling)[:2]
    return max(abs(mode.natural_frequency / omega - 1.0) for mode, omega in zip(elastic, structural, strict=True))


def _vertices(evidence: Evidence) -> Finding:
    model = evidence.design("baseline").certificate["model"]
    rows, columns = model["vertices"]
    tolerance = evidence.design("baseline").certificate["inputs"]["model"]["tensor_product"]["tolerance"]
    count = float(rows * columns)
    return Finding(
        (Reading("vertices", count, "1", at_most=20.0), Reading("vertices", count, "1", at_least=20.0)),
        f"{rows} in altitude by {columns} in velocity at a relative tolerance of {tolerance:g} of the singular "
        "values. The count depends on tolerance and scales, which the paper does not give.",
    )


def _accuracy(evidence: Evidence) -> Finding:
    accuracy = evidence.design("baseline").certificate["model"]["accuracy"]
    return Finding(
        (
            Reading("Bode magnitude apart, off the samples", accuracy["bode_magnitude_error_db"], "dB", at_most=1e-3),
            Reading("Bode phase apart", accuracy["bode_phase_error_deg"], "deg", at_most=1e-2),
        ),
        "Of the decoupled model, over 37 points, all states and inputs. What the coupling changes is not in it.",
    )


def _weak_coupling(evidence: Evidence) -> Finding:
    return Finding(
        (
            Reading("shift of a mode, paper-like coupling", shift("paper_like"), "1", at_most=0.02),
            Reading("shift of a mode, derived coupling", shift("derived"), "1", at_most=0.02),
        ),
        "The paper gives no coupling. What a beam model of the vehicle yields (derived) is not weak; a quarter of it "
        "is.",
    )


def _bounded(evidence: Evidence) -> Finding:
    certificate = evidence.design("baseline").certificate["tube"]
    membership = certificate["flights"]["disturbance_membership"]
    flights = certificate["flights"]["flights"]
    other = evidence.design("baseline_derived").certificate
    derived, share = other["tube"]["flights"]["disturbance_membership"], other["inputs"]["disturbance"]["share"]
    return Finding(
        (
            Reading(
                f"disturbance over its bound, worst of {flights} flights", membership["worst_ratio"], "1", at_most=1.0
            ),
            Reading(
                f"the same, derived coupling, over the {share:g} W its controller is certified for",
                derived["worst_ratio"],
                "1",
                at_most=1.0,
            ),
        ),
        "W was measured on the nominal vehicle and a quarter of the corners and inflated by 1.1: a bound over what was "
        "flown, found by flying and not by proof. With the derived coupling all of W leaves no room for the plan, and "
        f"{derived['outside']} flights leave the part of it that does.",
    )


def _seven_modes(evidence: Evidence) -> Finding:
    found = open_loop_modes("paper_like")
    rigid = [mode for mode in found if mode.natural_frequency < 8.0]
    elastic = len(found) - len(rigid)
    poles = sum(1 + (mode.pole.imag > 0.0) for mode in rigid)
    return Finding(
        (
            Reading("aeroelastic modes", float(elastic), "1", at_least=2.0),
            Reading("poles of the rigid body", float(poles), "1", at_least=5.0),
            Reading("modes of the rigid body, a pair as one", float(len(rigid)), "1", at_least=5.0),
        ),
        "Five poles of the rigid body: counted as the two aeroelastic pairs are, the slow pair makes them four modes.",
    )


def _almost_structural(evidence: Evidence) -> Finding:
    readings = _weak_coupling(evidence).readings
    return Finding(
        readings,
        "The paper-like set was chosen for this statement, so that it meets it is no evidence; the coupling that a "
        "beam "
        "model yields does not.",
    )


def _underdamped(evidence: Evidence) -> Finding:
    elastic = open_loop_modes("paper_like")[:2]
    rigid = open_loop_modes("paper_like")[2:]
    frequencies = np.linspace(10.0, 25.0, 6000)
    coupled, alone = (
        pitch_rate_response(vehicle_parameters(name), frequencies) for name in ("paper_like", "decoupled")
    )
    raised = bode(coupled)[0] - bode(alone)[0]
    first, second = (peak(frequencies, coupled, *window) for window in ELASTIC_PEAKS.values())
    return Finding(
        (
            Reading(
                "largest damping ratio of an elastic mode", max(m.damping_ratio for m in elastic), "1", at_most=0.05
            ),
            Reading(
                "rise of the elevator's effect on pitch rate, first mode", float(raised[first]), "dB", at_least=3.0
            ),
            Reading("the same, second mode", float(raised[second]), "dB", at_least=3.0),
        ),
        "Rise at the peaks of the coupled model over the decoupled one. Real parts "
        f"{elastic[0].pole.real:.2f} and {elastic[1].pole.real:.2f} 1/s. The pole that dominates the open "
        f"loop is another: the rigid body is unstable, {max(m.pole.real for m in rigid):+.2f} 1/s.",
    )


CLAIMS = (
    Claim("twenty vertices", "And a polytopic LPV model with 20 vertices is built.", "5.1, Case 1", _vertices),
    Claim(
        "accuracy of the polytopic model",
        "It can be seen that the two lines overlap very well. In other words, the established LPV model has high "
        "accuracy.",
        "3.1, Figure 2",
        _accuracy,
    ),
    Claim(
        "weak coupling",
        "To linearize nonlinear vehicle model, the weak coupling between the rigid body and the flexible modes is "
        "ignored (called Decoupling Model, DM).",
        "3.1",
        _weak_coupling,
    ),
    Claim(
        "bounded disturbance",
        "In summary, uncertain parameters, modelling error, and actuator failure of flexible hypersonic vehicle can "
        "be lumped into a bounded term Δ.",
        "3.1, (18)",
        _bounded,
    ),
    Claim(
        "seven modes",
        "From Figure 4, it can be seen that CM (1) has a total of 7 motion modes, including five motion modes of "
        "rigid body and two aeroelastic modes.",
        "3.3, Figure 4",
        _seven_modes,
    ),
    Claim(
        "almost structural frequencies",
        "Two flexible modes correspond to two pairs of underdamped conjugate complex roots, whose natural frequencies "
        "are almost consistent with the natural frequencies of structural flexibility.",
        "3.3, Figure 4",
        _almost_structural,
    ),
    Claim(
        "near the imaginary axis",
        "Since the two pairs of underdamped conjugate complex roots are close to the imaginary axis, both of the two "
        "flexible modes have a great influence on CM (1).",
        "3.3, Figure 4",
        _underdamped,
    ),
)
