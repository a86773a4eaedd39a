"""Numbers of sections 4.1 to 4.3 and 5.1 on the co-designed model, its gains and its sets."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from hsv.base.units import FOOT
from hsv.control.design import ControlDesign
from hsv.control.optimisation import spectral_radii
from hsv.design.disturbance import DisturbanceSet
from hsv.design.inputs import DesignInputs, inputs_from_report
from hsv.design.tube import invariant_set
from hsv.design.tube_problem import tube_problem
from hsv.model.lpv.linearisation import bode_difference, frequency_response
from hsv.model.signals import N_RIGID, PITCH_RATE
from hsv_paper.claims import modelling
from hsv_paper.claims.evidence import Evidence
from hsv_paper.extended_model import codesigned_model, extended_model
from hsv_paper.figures.figure_08 import FREQUENCIES, POINT
from hsv_paper.linear_loop import ELEVATOR

DESIGN = "adjustable"

RIGID = 10.0
"""rad/s: frequency between the rigid body and the elastic modes."""


def vertices(evidence: Evidence) -> dict[str, Any]:
    """Return the vertices of the co-designed model, and number and tolerance of those of the baseline."""
    other = modelling.vertices(evidence)
    return modelling.vertices(evidence, DESIGN) | {"baseline": f"{other['count']:.0f}", "finer": other["tolerance"]}


def conforms(evidence: Evidence) -> dict[str, Any]:
    """Return the differences between the co-designed model and the ECM, and where they are largest."""
    decibel, degree = _apart(evidence, "paper_like")
    low = FREQUENCIES < RIGID
    return {
        "magnitude": decibel.max(),
        "phase": degree.max(),
        "low_magnitude": decibel[low].max(),
        "low_phase": degree[low].max(),
        "low_derived": _apart(evidence, "derived")[0][low].max(),
        "rigid": RIGID,
        "lowest": FREQUENCIES[0],
        "highest": FREQUENCIES[-1],
        "loud": FREQUENCIES[int(decibel.argmax())],
        "late": FREQUENCIES[int(degree.argmax())],
    }


def _apart(evidence: Evidence, coupling: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the differences (f), dB and deg, between co-designed model and ECM, elevator to filtered pitch rate."""
    inputs = inputs_from_report(evidence.design(DESIGN).certificate["inputs"])
    point, period = (POINT[0] * FOOT, POINT[1] * FOOT), inputs.model.period
    model, ecm = (
        frequency_response(*system, FREQUENCIES, period)[:, PITCH_RATE, ELEVATOR]
        for system in (codesigned_model(inputs, point), extended_model(inputs, coupling, point))
    )
    return bode_difference(model, ecm)


def stabilises(evidence: Evidence) -> dict[str, Any]:
    """Return the smallest distance of the closed-loop spectral radius from 1 over gains and vertices."""
    flown = evidence.design(DESIGN).flown
    A, B = flown.polytope.A, flown.polytope.B
    radius = max(float(spectral_radii(A + B @ gain).max()) for gain in flown.nominal_gains)
    return {"decay": 1.0 - radius, "gains": len(flown.nominal_gains), "vertices": len(A)}


def sets(evidence: Evidence) -> dict[str, Any]:
    """Return half-widths (7) relative to those of Z: of Z' as flown, and of the sets under F' for W' and W / 2."""
    flown = evidence.design(DESIGN).flown
    assert flown.tube is not None
    whole, measured, halved = _half_widths(evidence)
    tau, ratio = float(flown.tau.min()), flown.tube.half_width / whole
    complete, incomplete = _disturbances(evidence)
    moving = complete.half_width > 0.0
    shares = incomplete.half_width[moving] / complete.half_width[moving]
    return {
        "halved": halved / whole,
        "measured": measured / whole,
        "measured_scaled": measured / (tau * whole),
        "flown": ratio,
        "flown_scaled": flown.tube.half_width / (tau * whole),
        "mean": ratio.mean(),
        "altitude": ratio[0],
        "velocity": ratio[1],
        "least_share": shares.min(),
        "largest_share": shares.max(),
    }


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
