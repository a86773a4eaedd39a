"""Numbers of sections 3.1, 3.3 and 5.1: the polytopic model, its disturbances, and the modes of the coupled one."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import Mode, bode, modes
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.figures.bode import pitch_rate_response
from hsv_paper.linear_loop import START
from hsv_paper.mode_peaks import FREQUENCIES, elastic_modes, peak_falls

SLOWEST_ELASTIC = 8.0
"""rad/s: half the lower structural frequency; slower modes belong to the rigid body."""


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


def rise(coupling: str | float) -> np.ndarray:
    """Return the increase (dB) by coupling of the pitch-rate response to the elevator, at the modes' frequencies."""
    coupled, alone = (pitch_rate_response(load_vehicle().coupled(name), FREQUENCIES) for name in (coupling, 0.0))
    return bode(coupled)[0] - bode(alone)[0]


def vertices(evidence: Evidence, design: str = "baseline") -> dict[str, Any]:
    """Return the number of vertices of a design's model, and the relative tolerance of the singular values."""
    model = evidence.design(design).certificate
    rows, columns = model["model"]["vertices"]
    tolerance = model["inputs"]["model"]["tensor_product"]["tolerance"]
    return {"rows": rows, "columns": columns, "count": float(rows * columns), "tolerance": tolerance}


def coupling(evidence: Evidence) -> dict[str, Any]:
    """Return the effect of coupling on the modes and on the pitch-rate response.

    ``almost``: the largest relative shift of a mode that counts as none, a tenth of the distance of the two modes.
    """
    vehicle = load_vehicle().decoupled
    return {
        "raised": float(np.abs(rise("paper_like")).max()),
        "paper_like": shift("paper_like"),
        "derived": shift("derived"),
        "almost": 0.1 * abs(vehicle.natural_frequency_2 / vehicle.natural_frequency_1 - 1.0),
    }


def disturbance(evidence: Evidence) -> dict[str, Any]:
    """Return the number of flights on which W was measured, and the number of those that leave it."""
    certificate, other = (evidence.design(name).certificate for name in ("baseline", "baseline_derived"))
    tube, flights = certificate["tube"], other["tube"]["flights"]
    return {
        "measured": tube["disturbance"]["flights"] - 1,
        "inflation": certificate["inputs"]["disturbance"]["inflation"],
        "flights": tube["flights"]["flights"],
        "corners": tube["flights"]["flights"] - 1,
        "share": other["inputs"]["disturbance"]["share"],
        "outside": flights["disturbance_membership"]["outside"],
        "flights_derived": flights["flights"],
    }


def seven_modes(evidence: Evidence) -> dict[str, Any]:
    """Return the numbers of elastic and rigid-body modes of the coupled model, and of the rigid body's poles."""
    found = open_loop_modes("paper_like")
    rigid = [mode for mode in found if mode.natural_frequency < SLOWEST_ELASTIC]
    poles = sum(1 + (mode.pole.imag > 0.0) for mode in rigid)
    return {"all": len(found), "elastic": len(found) - len(rigid), "rigid": len(rigid), "poles": poles}


def underdamped(evidence: Evidence) -> dict[str, Any]:
    """Return damping and real parts of the elastic modes, the rise at their peaks, and the unstable pole."""
    elastic = list(elastic_modes("paper_like").values())
    raised = rise("paper_like")
    first, second = (float(np.interp(fall.before.frequency, FREQUENCIES, raised)) for fall in peak_falls(()).values())
    return {
        "damping": max(mode.damping_ratio for mode in elastic),
        "first": first,
        "second": second,
        "pole_1": elastic[0].pole.real,
        "pole_2": elastic[1].pole.real,
        "unstable": max(mode.pole.real for mode in open_loop_modes("paper_like")),
    }
