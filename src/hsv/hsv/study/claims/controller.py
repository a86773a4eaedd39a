"""Claims of section 3.2: the baseline controller, its set, its inputs."""

from __future__ import annotations

import numpy as np

from hsv.control.nominal_trajectory import FamilyLaw, nominal_data
from hsv.design.lmi import spectral_radii
from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.units import to_paper
from hsv.vehicle.envelope import FOOT

FLIGHT = "case1"


def _feedback(evidence: Evidence) -> Finding:
    feedback = evidence.design("baseline").certificate["feedback"]
    return Finding(
        (
            Reading(
                "least eigenvalue of (24) over the vertices",
                min(feedback["lmi_smallest_eigenvalues"]),
                "1",
                at_least=0.0,
            ),
            Reading("spectral radius of A + BF", feedback["spectral_radius_all_states"], "1", at_most=1.0),
        ),
        "Of the error system of the decoupled model, as the lemma says. (24) alone leaves the gain open: ours has a "
        "guaranteed cost besides.",
    )


def _box(evidence: Evidence) -> Finding:
    flown = evidence.design("baseline").flown
    closed = np.abs(flown.polytope.A + flown.polytope.B @ flown.feedback_gain)
    radius = float(spectral_radii(closed.max(axis=0)[None]).max())
    certificate = evidence.design("baseline").certificate["tube"]["invariant_set"]
    sampling = certificate["sampling"]
    return Finding(
        (
            Reading("the box (25) to (28): spectral radius of max |A_i + B_i F|", radius, "1", at_most=1.0),
            Reading(
                "the ellipsoid: least eigenvalue of its conditions",
                min(certificate["certificate"]["lmi_smallest_eigenvalues"]),
                "1",
                at_least=0.0,
            ),
            Reading(
                f"the ellipsoid: worst level of {sampling['sequences']} sequences",
                sampling["worst_level"],
                "1",
                at_most=1.0,
            ),
        ),
        "The paper's box does not exist in these coordinates: with absolute values entry by entry a pair of states "
        "that swing or integrate into each other no longer decays. An ellipsoid about a shifted centre, with the "
        "filter's states in it, does, and is certified at every "
        "vertex.",
    )


def _in_the_set(evidence: Evidence) -> Finding:
    table = evidence.corners(FLIGHT)
    count = len(table["tube_level"]) - 1
    return Finding(
        (
            Reading("worst level of e - c, nominal", nominal(table, "tube_level"), "1", at_most=1.0),
            Reading(f"worst level, {count} corners", worst(table, "tube_level"), "1", at_most=1.0),
        ),
        "In the certified ellipsoid, over the whole flight and through the fault.",
    )


def _close_to_nominal(evidence: Evidence) -> Finding:
    table = evidence.corners(FLIGHT)
    return Finding(
        (
            Reading(
                "attitude from nominal, nominal vehicle",
                nominal(table, "attitude_from_nominal"),
                "rad",
                at_most=np.radians(0.5),
            ),
            Reading(
                "attitude from nominal, corners", worst(table, "attitude_from_nominal"), "rad", at_most=np.radians(0.5)
            ),
            Reading(
                "altitude from the command at the end, nominal vehicle",
                nominal(table, "altitude_end_error"),
                "m",
                at_most=8.0 * FOOT,
            ),
            Reading(
                "altitude from the command at the end, corners",
                worst(table, "altitude_end_error"),
                "m",
                at_most=8.0 * FOOT,
            ),
        ),
        "Close, not to it: without integral action a wrong mass and the lost elevator leave an offset.",
    )


def _input_set(evidence: Evidence) -> Finding:
    certificate = evidence.design("baseline").certificate["tube"]["tightening"]
    widths = np.array(certificate["upper"]) - np.array(certificate["lower"])
    rooms = np.minimum(certificate["plan"]["margin_to_lower"], certificate["plan"]["margin_to_upper"])
    derived = evidence.design("baseline_derived").certificate["inputs"]["disturbance"]["share"]
    return Finding(
        (
            Reading("width of U - FZ, fuel", float(widths[0]), "1", at_least=0.0),
            Reading("width of U - FZ, elevator", float(widths[1]), "rad", at_least=0.0),
            Reading("room of the nominal plan in it, fuel", float(rooms[0]), "1", at_least=0.0),
            Reading("room of the nominal plan in it, elevator", float(rooms[1]), "rad", at_least=0.0),
            Reading("share of W for which this is so, derived coupling", float(derived), "1", at_least=1.0),
        ),
        "Not empty is the weak test; that the nominal plan fits, trim included, is the one that matters. With the "
        f"derived coupling it fits for {derived:g} W only.",
    )


def _nominal_stable(evidence: Evidence) -> Finding:
    certificate = evidence.design("baseline").certificate
    radius = max(gain["spectral_radius_all_states"] for gain in certificate["nominal"])
    return Finding(
        (Reading("1 less the spectral radius of A + BK, worst gain and vertex", 1.0 - radius, "1", at_least=0.0),),
        "For each of the seven nested gains, one Lyapunov function over all vertices (34).",
    )


def _input_bound(evidence: Evidence) -> Finding:
    flown = evidence.design("baseline").flown
    flight = evidence.flights[FLIGHT]
    law = FamilyLaw(nominal_data(flown))
    u_n = np.array([law.step(deviation).input for deviation in flight.deviation])
    ratio = float((np.abs(u_n) / flown.nominal_input_bound).max())
    single = abs(evidence.changed("case1_single_k")["velocity_end_error"])
    return Finding(
        (Reading("|u_n| over its bound, whole flight, nominal vehicle", ratio, "1", at_most=1.0),),
        "The bound is kept and is what slows the flight: symmetric about trim, it forgoes most of the fuel that U "
        "leaves. A single K misses the velocity by "
        f"{to_paper(single, 'm/s')[0]:.0f} ft/s at the end; nested gains settle.",
    )


def _nominal_in_the_set(evidence: Evidence) -> Finding:
    outermost = evidence.design("baseline").flown.nominal_ellipsoids[0]
    rigid = evidence.flights[FLIGHT].deviation[:, : len(outermost)]
    levels = np.einsum("ki,ij,kj->k", rigid, outermost, rigid)
    return Finding(
        (
            Reading("level of x_n at the step", float(levels[0]), "1", at_most=1.0),
            Reading("largest level of x_n in flight, nominal vehicle", float(levels.max()), "1", at_most=1.0),
        ),
        "In the ellipsoid of the outermost gain; the set is that of Q^-1, not of Q as printed ([errata](errata.md)).",
    )


CLAIMS = (
    Claim(
        "feedback stabilises",
        "Then the auxiliary robust feedback control gain F = M_F N_F^{-1} can ensure the stability of system (18).",
        "3.2, Lemma 1",
        _feedback,
    ),
    Claim(
        "an invariant set exists",
        "From Definition 1, we know that e(k) is always located in the mRPI set.",
        "3.2, (25)-(28)",
        _box,
    ),
    Claim(
        "the trajectory enters and keeps to the set",
        "The control law (16) forces the trajectory of the actual system into mRPI set and the actual trajectory will "
        "get close to the nominal.",
        "3.2",
        _in_the_set,
    ),
    Claim(
        "the trajectory comes close to the nominal",
        "The robust auxiliary feedback control law steers the actual trajectory into the mRPI set and makes it "
        "approximate the nominal trajectory.",
        "1",
        _close_to_nominal,
    ),
    Claim("inputs are left for the plan", "... and there is U ⊖ FZ ≠ ∅.", "3.2, (30)", _input_set),
    Claim(
        "the nominal law stabilises",
        "In conclusion, the nominal control law u_n(k) = Kx_n(k) = YG^{-1}x_n(k) can guarantee the stability of the "
        "nominal system (15).",
        "3.2",
        _nominal_stable,
    ),
    Claim(
        "nominal states stay in their set",
        "LMI constraint (33) guarantees that the nominal states stay in the invariant set with respect to the nominal "
        "control law u_n(k)",
        "3.2, (33)",
        _nominal_in_the_set,
    ),
    Claim(
        "nominal inputs are bounded",
        "Equation (35) is derived from the input constraint |u_nj| ≤ u_nj,max.",
        "3.2, (35)",
        _input_bound,
    ),
)
