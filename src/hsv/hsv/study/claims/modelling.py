"""Claims of section 3.1 and 5.1: the polytopic model and the disturbances."""

from __future__ import annotations

import numpy as np

from hsv.lpv.frequency import bode
from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence
from hsv.study.figures.bode import pitch_rate_response
from hsv.study.linear_loop import START
from hsv.study.mode_peaks import FREQUENCIES, elastic_modes, peak_falls
from hsv.vehicle.dynamics import jacobian
from hsv.vehicle.modes import Mode, modes
from hsv.vehicle.trim import trim
from hsv.vehicle.vehicle import load_vehicle

OVERLAP = {"dB": 0.1, "deg": 1.0}
"""How far apart two lines of a Bode plot may be and still look like one."""

RAISED = 3.0
"""dB: from here on a change of the response counts as one, of its power by a factor of two."""

SLOWEST_ELASTIC = 8.0
"""rad/s: half the lower structural frequency; slower modes are the rigid body's."""


def open_loop_modes(coupling: str | float) -> list[Mode]:
    """Return the modes of the coupled model where Case 1 starts, fastest first."""
    vehicle = load_vehicle().coupled(coupling)
    point = trim(vehicle, *START)
    return modes(jacobian(point.state, point.input, vehicle)[0])


def shift(coupling: str | float) -> float:
    """Return the largest relative distance of a coupled elastic mode from its structural frequency."""
    vehicle = load_vehicle().coupled(coupling)
    structural = {"first": vehicle.natural_frequency_1, "second": vehicle.natural_frequency_2}
    return max(abs(mode.natural_frequency / structural[n] - 1.0) for n, mode in elastic_modes(coupling).items())


def almost() -> float:
    """Return the relative shift of a mode up to which it counts as unmoved: a tenth of what parts the two modes."""
    vehicle = load_vehicle().decoupled
    return 0.1 * abs(vehicle.natural_frequency_2 / vehicle.natural_frequency_1 - 1.0)


def rise(coupling: str | float) -> np.ndarray:
    """Return by how many dB coupling raises the pitch rate's answer to the elevator, over the modes' frequencies."""
    coupled, alone = (pitch_rate_response(load_vehicle().coupled(name), FREQUENCIES) for name in (coupling, 0.0))
    return bode(coupled)[0] - bode(alone)[0]


def exactly(what: str, value: float, count: float) -> tuple[Reading, Reading]:
    """Return the readings of a count that is to be neither more nor less."""
    return Reading(what, value, "1", at_most=count), Reading(what, value, "1", at_least=count)


def _vertices(evidence: Evidence) -> Finding:
    certificate = evidence.design("baseline").certificate
    rows, columns = certificate["model"]["vertices"]
    tolerance = certificate["inputs"]["model"]["tensor_product"]["tolerance"]
    return Finding(
        exactly("vertices", float(rows * columns), 20.0),
        f"{rows} in altitude by {columns} in velocity at a relative tolerance of {tolerance:g} of the singular "
        "values. The count depends on tolerance and scales, which the paper does not give.",
        leading=2,
    )


def _accuracy(evidence: Evidence) -> Finding:
    accuracy = evidence.design("baseline").certificate["model"]["accuracy"]
    magnitude, phase = accuracy["bode_magnitude_error_db"], accuracy["bode_phase_error_deg"]
    return Finding(
        (
            Reading("Bode magnitude apart, off the samples", magnitude, "dB", at_most=OVERLAP["dB"]),
            Reading("Bode phase apart", phase, "deg", at_most=OVERLAP["deg"]),
            Reading(
                "magnitude apart from the coupled model, elevator to pitch rate, about the modes",
                float(np.abs(rise("paper_like")).max()),
                "dB",
                at_most=OVERLAP["dB"],
            ),
        ),
        f"Of the decoupled model, all states and inputs: the matrices are compared at {accuracy['points']} points of "
        "the envelope, Bode plots at the worst of them and over the envelope. Thresholds: what two lines may be apart "
        "and still look like one. What the coupling changes, and the vehicle flown has, is not in the model.",
        leading=2,
    )


def _weak_coupling(evidence: Evidence) -> Finding:
    raised = float(np.abs(rise("paper_like")).max())
    return Finding(
        (
            Reading("shift of a mode, paper-like coupling", shift("paper_like"), "1", at_most=almost()),
            Reading("change of the pitch rate's answer to the elevator, the same", raised, "dB", at_most=RAISED),
            Reading("shift of a mode, derived coupling", shift("derived"), "1", at_most=almost()),
        ),
        "The paper gives no coupling. A quarter of what a beam model of the vehicle yields (derived) hardly moves the "
        "modes (threshold: a tenth of what parts them), but about them it changes what the elevator does to the pitch "
        "rate by more than 3 dB, twice the power; all of it is not weak at all.",
    )


def _bounded(evidence: Evidence) -> Finding:
    certificate = evidence.design("baseline").certificate
    tube, inflation = certificate["tube"], certificate["inputs"]["disturbance"]["inflation"]
    measured, flights = tube["disturbance"]["flights"], tube["flights"]["flights"]
    other = evidence.design("baseline_derived").certificate
    share = other["inputs"]["disturbance"]["share"]
    derived = other["tube"]["flights"]["disturbance_membership"]
    return Finding(
        (
            Reading(
                f"disturbance over its bound, worst of {flights} flights",
                tube["flights"]["disturbance_membership"]["worst_ratio"],
                "1",
                at_most=1.0,
            ),
            Reading(
                f"the same, derived coupling, over the {share:g} W its controller is certified for",
                derived["worst_ratio"],
                "1",
                at_most=1.0,
            ),
        ),
        f"W was measured on the nominal vehicle and {measured - 1} of the {flights - 1} corners and inflated by "
        f"{inflation:g}: a bound over what was flown, found by flying and not by proof. With the derived coupling all "
        f"of W leaves no room for the plan, and {derived['outside']} of {other['tube']['flights']['flights']} flights "
        "leave the part of it that does.",
    )


def _seven_modes(evidence: Evidence) -> Finding:
    found = open_loop_modes("paper_like")
    rigid = [mode for mode in found if mode.natural_frequency < SLOWEST_ELASTIC]
    elastic = len(found) - len(rigid)
    poles = sum(1 + (mode.pole.imag > 0.0) for mode in rigid)
    return Finding(
        (
            *exactly("aeroelastic modes, pairs of poles", float(elastic), 2.0),
            *exactly("poles of the rigid body", float(poles), 5.0),
            Reading("modes of the rigid body, a pair as one, as above", float(len(rigid)), "1", at_least=5.0),
        ),
        "Seven if the rigid body's poles are counted one by one and the aeroelastic ones by the pair; counted alike, "
        f"the slow pair makes one mode and all are {len(found)}.",
        leading=4,
    )


def _almost_structural(evidence: Evidence) -> Finding:
    return Finding(
        (
            Reading("shift of a mode, paper-like coupling", shift("paper_like"), "1", at_most=almost()),
            Reading("shift of a mode, derived coupling", shift("derived"), "1", at_most=almost()),
        ),
        "The paper-like set was chosen for this statement, so that it meets it is no evidence; the coupling that a "
        "beam model yields does not. Threshold: a tenth of what parts the two modes.",
    )


def _underdamped(evidence: Evidence) -> Finding:
    elastic = list(elastic_modes("paper_like").values())
    rigid = [mode for mode in open_loop_modes("paper_like") if mode.natural_frequency < SLOWEST_ELASTIC]
    raised = rise("paper_like")
    first, second = (float(np.interp(fall.before.frequency, FREQUENCIES, raised)) for fall in peak_falls(()).values())
    return Finding(
        (
            Reading(
                "largest damping ratio of an elastic mode", max(m.damping_ratio for m in elastic), "1", at_most=0.05
            ),
            Reading("rise of the elevator's effect on pitch rate, first mode", first, "dB", at_least=RAISED),
            Reading("the same, second mode", second, "dB", at_least=RAISED),
        ),
        "Rise at the peaks of the coupled model over the decoupled one; 3 dB are twice the power, a damping ratio of "
        f"0.05 a decay to about a half in two periods. Real parts {elastic[0].pole.real:.2f} and "
        f"{elastic[1].pole.real:.2f} 1/s. The pole that dominates the open loop is another: the rigid body is "
        f"unstable, {max(m.pole.real for m in rigid):+.2f} 1/s.",
        leading=3,
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
