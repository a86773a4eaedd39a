"""Claims of section 3.2: the baseline controller, its set, its inputs."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from hsv.control.nominal_trajectory import FamilyLaw, nominal_data
from hsv.design.lmi import spectral_radii
from hsv.study.claims.claim import Claim, Finding, Reading
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.claims.thresholds import ALTITUDE_BAND, HALF_DEGREE
from hsv.units import to_paper
from hsv.vehicle.dynamics import N_RIGID

FLIGHT, DERIVED, RAMP = "case1", "case1_derived", "case2_baseline"

SYMMETRIC = 0.1
"""Of the half-width: how far off zero a centre may be; the bounds are known to their inflation, a tenth."""


ROUNDING = 1e-12
"""Of a level that starts at 1."""


def kept_of_level(A: np.ndarray, B: np.ndarray, gain: np.ndarray, shape: np.ndarray) -> float:
    """Return the most that x' P x keeps over a step under u = K x, at worst vertex and state: below 1 it decreases.

    What holds at the vertices holds in the whole polytope, x' P x being convex.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m).
        gain: (m, n) K.
        shape: (n, n) P.
    """
    closed = A + B @ gain
    return max(float(eigh(M.T @ shape @ M, shape, eigvals_only=True)[-1]) for M in closed)


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
        "The paper's set is a box, and that does not exist in these coordinates: with absolute values entry by entry a "
        "pair of states that swing or integrate into each other no longer decays. In its place we certify, at every "
        "vertex, an ellipsoid about a shifted centre with the filter's states in it.",
    )


def _in_the_set(evidence: Evidence) -> Finding:
    table, derived = evidence.corners(FLIGHT), evidence.corners(DERIVED)
    count = len(table["tube_level"]) - 1
    contraction = evidence.design("baseline").certificate["tube"]["invariant_set"]["contraction"]
    return Finding(
        (
            Reading("worst level of e - c, nominal", nominal(table, "tube_level"), "1", at_most=1.0),
            Reading(f"worst level, {count} corners", worst(table, "tube_level"), "1", at_most=1.0),
            Reading("what a level above 1 keeps over a step, certified", contraction, "1", at_most=1.0),
            Reading(f"worst level, {count} corners, derived coupling", worst(derived, "tube_level"), "1", at_most=1.0),
        ),
        "In the certified ellipsoid, not the paper's box, over the whole flight and through the fault. Every flight "
        "starts in it; that errors from outside return is the certificate's.",
        leading=2,
    )


def _close_to_nominal(evidence: Evidence) -> Finding:
    attitude, altitude = (evidence.spread(FLIGHT, name) for name in ("attitude_from_nominal", "altitude_end_error"))
    first, *angles = attitude.readings("attitude from nominal", "rad", at_most=HALF_DEGREE)
    second, *heights = altitude.readings("altitude from the command at the end", "m", at_most=ALTITUDE_BAND)
    return Finding(
        (first, second, *angles, *heights),
        "Close, not to it: without integral action a wrong mass and the lost elevator leave an offset. Of "
        f"{evidence.vehicles} vehicles {np.count_nonzero(attitude.vehicles > HALF_DEGREE)} leave the half degree, "
        f"{np.count_nonzero(altitude.vehicles > ALTITUDE_BAND)} end outside the band in altitude, where the nominal "
        "trajectory has come to the command.",
        leading=2,
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
        leading=2,
    )


def _nominal_stable(evidence: Evidence) -> Finding:
    gains = evidence.design("baseline").certificate["nominal"]
    radius = max(gain["spectral_radius_all_states"] for gain in gains)
    level = _levels(evidence, FLIGHT)
    return Finding(
        (
            Reading("spectral radius of A + BK, worst gain and vertex", radius, "1", at_most=1.0),
            Reading("what is left at the end of the level of x_n", float(level[-1] / level[0]), "1", at_most=1e-3),
        ),
        f"For each of the {len(gains)} nested gains, over all vertices; in flight the gains switch as x_n shrinks.",
    )


def _lyapunov(evidence: Evidence) -> Finding:
    flown, gains = evidence.design("baseline").flown, evidence.design("baseline").certificate["nominal"]
    A, B = flown.polytope.A[:, :N_RIGID, :N_RIGID], flown.polytope.B[:, :N_RIGID]
    kept = [
        kept_of_level(A, B, gain[:, :N_RIGID], shape)
        for gain, shape in zip(flown.nominal_gains, flown.nominal_ellipsoids, strict=True)
    ]
    return Finding(
        (
            Reading(
                "least eigenvalue of (34) over gains and vertices",
                min(min(gain["lmi_smallest_eigenvalues"]) for gain in gains),
                "1",
                at_least=0.0,
            ),
            Reading("what the function keeps over a step at most, gains and vertices", max(kept), "1", at_most=1.0),
            Reading(
                "its largest rise over a step in flight",
                float(np.diff(_levels(evidence, FLIGHT)).max()),
                "1",
                at_most=ROUNDING,
            ),
        ),
        f"x_n' Q^-1 x_n, certified for each of the {len(gains)} nested gains and in flight that of the outermost. The "
        "eigenvalue is small because the cost bound is minimised up to it; what is kept over a step is the plain "
        "statement.",
        leading=2,
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
    step, ramp = _levels(evidence, FLIGHT), _levels(evidence, RAMP)
    return Finding(
        (
            Reading("level of x_n at the step", float(step[0]), "1", at_most=1.0),
            Reading("largest level of x_n in flight, nominal vehicle", float(step.max()), "1", at_most=1.0),
            Reading("the same on the ramp of Case 2, baseline controller", float(ramp.max()), "1", at_most=1.0),
        ),
        "In the ellipsoid of the outermost gain, which is made for the step and starts on its edge; the set is that of "
        "Q^-1, not of Q as printed ([errata](errata.md)).",
        leading=2,
    )


def _symmetric(evidence: Evidence) -> Finding:
    tube = evidence.design("baseline").flown.tube
    assert tube is not None
    channels = evidence.design("baseline").certificate["tube"]["disturbance"]["channels"]
    off = {
        name: abs(bounds["upper"] + bounds["lower"]) / (bounds["upper"] - bounds["lower"])
        for name, bounds in channels.items()
    }
    name = max(off, key=lambda channel: off[channel])
    return Finding(
        (
            Reading(f"W: centre over half-width, {name.replace('_', ' ')}", off[name], "1", at_most=SYMMETRIC),
            Reading(
                "Z: centre over half-width, worst state",
                float(np.abs(tube.centre / tube.half_width).max()),
                "1",
                at_most=SYMMETRIC,
            ),
        ),
        "A loss of effectiveness takes elevator away and never adds any, and the trim's elevator is large: W is "
        "one-sided, and (19) prints it with two different bounds. Symmetric in, symmetric out is true; so Z is "
        "symmetric about the centre c that the mid-point of W moves it to, not about the origin. Threshold: the "
        "bounds are known to their inflation, a tenth.",
        leading=2,
    )


def _levels(evidence: Evidence, scenario: str) -> np.ndarray:
    """Return the level (n) of x_n in the ellipsoid of the outermost gain over a nominal flight."""
    outermost = evidence.design("baseline").flown.nominal_ellipsoids[0]
    rigid = evidence.flights[scenario].deviation[:, : len(outermost)]
    return np.asarray(np.einsum("ki,ij,kj->k", rigid, outermost, rigid))


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
        "symmetric sets",
        "Due to W being symmetric around the origin, the mRPI set Z has the same symmetric characteristic around the "
        "origin.",
        "3.2, (25)",
        _symmetric,
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
        "Section 1",
        _close_to_nominal,
    ),
    Claim(
        "inputs are left for the plan",
        "where ⊖ is the Pontryagin set difference, and there is U ⊖ FZ ≠ ∅.",
        "3.2, (30)",
        _input_set,
    ),
    Claim(
        "the nominal law stabilises",
        "In conclusion, the nominal control law u_n(k) = Kx_n(k) = YG^{-1}x_n(k) can guarantee the stability of the "
        "nominal system (15).",
        "3.2",
        _nominal_stable,
    ),
    Claim(
        "the Lyapunov function decreases",
        "Equation (34) indicates that the Lyapunov function of the nominal system (15) is decreasing [37].",
        "3.2, (34)",
        _lyapunov,
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
