"""Claims of sections 4.1 to 4.3 and 5.1 on the co-designed model, its gains and its sets."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from hsv.control.design_file import ControlDesign
from hsv.design.disturbance import DisturbanceSet
from hsv.design.inputs import DesignInputs, inputs_from_report
from hsv.design.tube import invariant_set
from hsv.design.tube_problem import tube_problem
from hsv.lpv.frequency import bode_difference, frequency_response
from hsv.study.claims.claim import Claim, Finding, Reading, shown
from hsv.study.claims.evidence import Evidence
from hsv.study.extended_model import codesigned_model, extended_model
from hsv.study.figures.figure_08 import FREQUENCIES, POINT
from hsv.study.linear_loop import ELEVATOR
from hsv.vehicle.dynamics import N_RIGID, PITCH_RATE
from hsv.vehicle.envelope import FOOT

DESIGN = "adjustable"

ONE_LINE = (1.0, 5.0)
"""dB, deg: how far apart two lines of a Bode diagram of the paper's size may be and look like one."""

RIGID = 10.0
"""rad/s: below it is the rigid body, above it are the elastic modes."""


def _vertices(evidence: Evidence) -> Finding:
    certificate, other = evidence.design(DESIGN).certificate, evidence.design("baseline").certificate
    rows, columns = certificate["model"]["vertices"]
    tolerance, finer = (c["inputs"]["model"]["tensor_product"]["tolerance"] for c in (certificate, other))
    baseline = int(np.prod(other["model"]["vertices"]))
    count = float(rows * columns)
    return Finding(
        (Reading("vertices", count, "1", at_most=6.0), Reading("vertices", count, "1", at_least=6.0)),
        f"{rows} in altitude by {columns} in velocity at a relative tolerance of {tolerance:g} of the singular values; "
        f"the {baseline} vertices of the baseline are at {finer:g}: it is the tolerance, which the paper does not "
        "give, that makes the count, not the co-design.",
        leading=2,
    )


def _conforms(evidence: Evidence) -> Finding:
    accuracy = evidence.design(DESIGN).certificate["model"]["accuracy"]
    decibel, degree = _apart(evidence, "paper_like")
    derived = _apart(evidence, "derived")
    low = FREQUENCIES < RIGID
    loud, late = FREQUENCIES[int(decibel.argmax())], FREQUENCIES[int(degree.argmax())]
    return Finding(
        (
            Reading("magnitude from the ECM, paper-like coupling", decibel.max(), "dB", at_most=ONE_LINE[0]),
            Reading("phase from the ECM, paper-like coupling", degree.max(), "deg", at_most=ONE_LINE[1]),
            Reading(f"magnitude, the same below {RIGID:g} rad/s", decibel[low].max(), "dB", at_most=ONE_LINE[0]),
            Reading(f"phase, the same below {RIGID:g} rad/s", degree[low].max(), "deg", at_most=ONE_LINE[1]),
            Reading(
                f"magnitude, derived coupling, below {RIGID:g} rad/s", derived[0][low].max(), "dB", at_most=ONE_LINE[0]
            ),
            Reading(
                "magnitude from the ECM whose coupling is ignored, all channels",
                accuracy["bode_magnitude_error_db"],
                "dB",
                at_most=ONE_LINE[0],
            ),
            Reading("phase, the same", accuracy["bode_phase_error_deg"], "deg", at_most=ONE_LINE[1]),
        ),
        f"Elevator to filtered pitch rate as in Figure 8, {FREQUENCIES[0]:g} to {FREQUENCIES[-1]:g} rad/s; "
        f"{ONE_LINE[0]:g} dB and {ONE_LINE[1]:g} deg are what looks like one line. The ECM (40) has the coupling, and "
        f"with it the elastic peaks, which the model has not: they are farthest apart at {loud:.1f} rad/s in "
        f"magnitude, at {late:.1f} rad/s in phase.",
        leading=2,
    )


def _apart(evidence: Evidence, coupling: str) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much (f) in dB and deg the co-designed model is off the ECM, elevator to filtered pitch rate."""
    inputs = inputs_from_report(evidence.design(DESIGN).certificate["inputs"])
    point, period = (POINT[0] * FOOT, POINT[1] * FOOT), inputs.model.period
    model, ecm = (
        frequency_response(*system, FREQUENCIES, period)[:, PITCH_RATE, ELEVATOR]
        for system in (codesigned_model(inputs, point), extended_model(inputs, coupling, point))
    )
    return bode_difference(model, ecm)


def _stabilises(evidence: Evidence) -> Finding:
    flown, certificate = evidence.design(DESIGN).flown, evidence.design(DESIGN).certificate
    radii = [
        float(np.abs(np.linalg.eigvals(A + B @ gain)).max())
        for gain in flown.nominal_gains
        for A, B in zip(flown.polytope.A, flown.polytope.B, strict=True)
    ]
    conditions = min(min(member["lmi_smallest_eigenvalues"]) for member in certificate["nominal"])
    return Finding(
        (
            Reading("1 less the spectral radius of A' + B'K', largest", 1.0 - max(radii), "1", at_least=0.0),
            Reading("least eigenvalue of (51), worst gain and vertex", conditions, "1", at_least=0.0),
        ),
        f"{len(flown.nominal_gains)} nested gains over {len(flown.polytope.A)} vertices, each gain with one Lyapunov "
        "function for all of them (51). Of the decoupled model.",
    )


def _grows(evidence: Evidence) -> Finding:
    half_width, measured, halved = _half_widths(evidence)
    return Finding(
        (
            Reading("half-width of Z for W / 2 over Z, largest", _largest(halved, half_width), "1", at_most=1.0),
            Reading("the same, for W' as measured", _largest(measured, half_width), "1", at_most=1.0),
        ),
        "The set is found anew for each, under the same feedback F'. W' is measured with fault and parameter bounds "
        "scaled by tau.",
    )


def _smaller(evidence: Evidence) -> Finding:
    design = evidence.design(DESIGN)
    assert design.flown.tube is not None
    whole, measured, _ = _half_widths(evidence)
    flown = design.flown.tube.half_width
    ratios = flown / whole
    return Finding(
        (
            Reading("half-width of the flown Z' over Z, largest", float(ratios.max()), "1", at_most=1.0),
            Reading("the same, mean of all states", float(ratios.mean()), "1", at_most=1.0),
            Reading("the same, largest, for F' in place of tau F'", _largest(measured, whole), "1", at_most=1.0),
        ),
        "The set for F' itself shrinks with W'. But the law (48) applies tau F', a weaker feedback, and the set that "
        f"is invariant under both is {shown(float(ratios[0]), '1')} times Z in altitude, "
        f"{shown(float(ratios[1]), '1')} times in velocity.",
    )


def _scaled(evidence: Evidence) -> Finding:
    design = evidence.design(DESIGN)
    assert design.flown.tube is not None
    whole, measured, _ = _half_widths(evidence)
    tau = float(design.flown.tau.min())
    scaled = design.flown.tube.half_width / (tau * whole)
    complete, incomplete = _disturbances(evidence)
    moving = complete.half_width > 0.0
    shares = incomplete.half_width[moving] / complete.half_width[moving]
    return Finding(
        (
            Reading("half-width of Z', for tau F' and W', over tau Z, largest", float(scaled.max()), "1", at_most=1.0),
            Reading("the same for F' in place of tau F'", _largest(measured, tau * whole), "1", at_most=1.0),
        ),
        "Z' = tau Z follows for W' = tau W under the same feedback. The law applies tau F', and of the channels of W' "
        f"the half-widths are {shares.min():.2f} to {shares.max():.2f} of those of W.",
    )


@lru_cache(maxsize=1)
def _half_widths(evidence: Evidence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the half-widths (7) of the set under F' for W, for the measured W', and for W / 2."""
    design = evidence.design(DESIGN)
    inputs = inputs_from_report(design.certificate["inputs"])
    complete, incomplete = _disturbances(evidence)
    ones = np.ones(N_RIGID)
    whole = replace(design.flown, tau=ones, tau_minimum=ones)
    found = [_half_width(whole, inputs, disturbance) for disturbance in (complete, incomplete, complete.scaled(0.5))]
    return found[0], found[1], found[2]


def _disturbances(evidence: Evidence) -> tuple[DisturbanceSet, DisturbanceSet]:
    """Return W and W'."""
    stored = evidence.design(DESIGN).certificate["adjustable"]
    complete, incomplete = (
        DisturbanceSet.from_report(stored[name]["disturbance"]["channels"]) for name in ("complete", "incomplete")
    )
    return complete, incomplete


def _half_width(design: ControlDesign, inputs: DesignInputs, disturbance: DisturbanceSet) -> np.ndarray:
    return invariant_set(tube_problem(design, inputs.flown_vehicle, disturbance), inputs.invariant_set).half_width


def _largest(one: np.ndarray, other: np.ndarray) -> float:
    return float((one / other).max())


CLAIMS = (
    Claim(
        "six vertices",
        "In the same flight envelope, the codesigned polytopic LPV model with 6 vertices is built.",
        "5.1, Case 2",
        _vertices,
    ),
    Claim(
        "the co-designed model conforms",
        "It can be seen that the new model can also conform to the frequency characteristics of the original model.",
        "4.2, Figure 8",
        _conforms,
    ),
    Claim(
        "the adjustable nominal law stabilises",
        "Solving the above optimization problems, the adjustable nominal control law K' = Y'Q'^{-1} can stabilize the "
        "system.",
        "4.3",
        _stabilises,
    ),
    Claim(
        "the set grows with the disturbances",
        "The size of Z is positively correlated with the size of disturbance set W.",
        "4.3",
        _grows,
    ),
    Claim(
        "a smaller set can be selected",
        "Considering the nonworst case actuator fault, a smaller mRPI set Z' can be selected, where Z' is called "
        "incomplete disturbance mRPI (idmRPI) set.",
        "4.3",
        _smaller,
    ),
    Claim(
        "the set scales with tau",
        "Therefore, the relationship between Z and Z' can be expressed as Z' = τZ.",
        "4.3",
        _scaled,
    ),
)
