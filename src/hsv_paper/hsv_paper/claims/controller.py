"""Numbers of section 3.2: the baseline controller, its set, its inputs."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import eigh

from hsv.base.units import to_paper
from hsv.control.nominal_law import FamilyLaw
from hsv.control.nominal_trajectory import nominal_data
from hsv.model.signals import N_RIGID
from hsv_paper.box import infeasibility
from hsv_paper.claims.evidence import Evidence


def kept_of_level(A: np.ndarray, B: np.ndarray, gain: np.ndarray, shape: np.ndarray) -> float:
    """Return the largest factor per step on x' P x under u = K x over vertices and states; below 1 it decreases.

    The factor applies to the whole polytope, because x' P x is convex.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m).
        gain: (m, n) K.
        shape: (n, n) P.
    """
    closed = A + B @ gain
    return max(float(eigh(M.T @ shape @ M, shape, eigvals_only=True)[-1]) for M in closed)


def box(evidence: Evidence) -> dict[str, Any]:
    """Return the spectral radius that must be below 1 for the paper's box to exist."""
    flown = evidence.design("baseline").flown
    delta = evidence.design("baseline").certificate["tube"]["disturbance"]["boxes"]["delta"]
    half_width = 0.5 * np.subtract(delta["upper"], delta["lower"])
    return {"radius": infeasibility(flown.polytope.A + flown.polytope.B @ flown.feedback_gain, half_width).radius}


def certified_attitude(evidence: Evidence) -> dict[str, Any]:
    """Return the half-width (rad) of the invariant set in the attitude angles."""
    return {"attitude": float(evidence.half_width[2:4].max())}


def input_set(evidence: Evidence) -> dict[str, Any]:
    """Return the widths of U ⊖ FZ and the margins of the nominal trajectory in it."""
    tightening = evidence.design("baseline").certificate["tube"]["tightening"]
    widths = np.array(tightening["upper"]) - np.array(tightening["lower"])
    rooms = np.minimum(tightening["plan"]["margin_to_lower"], tightening["plan"]["margin_to_upper"])
    return {"fuel": widths[0], "elevator": widths[1], "room_fuel": rooms[0], "room_elevator": rooms[1]}


def nominal(evidence: Evidence) -> dict[str, Any]:
    """Return the factors on the Lyapunov functions of the nominal gains, and the level of x_n over the flights."""
    flown = evidence.design("baseline").flown
    A, B = flown.polytope.A[:, :N_RIGID, :N_RIGID], flown.polytope.B[:, :N_RIGID]
    step, ramp = _levels(evidence, "case1"), _levels(evidence, "case2_baseline")
    return {
        "gains": len(flown.nominal_gains),
        "kept": max(
            kept_of_level(A, B, gain[:, :N_RIGID], shape)
            for gain, shape in zip(flown.nominal_gains, flown.nominal_ellipsoids, strict=True)
        ),
        "rise": float(np.diff(step).max()),
        "left": float(step[-1] / step[0]),
        "first": float(step[0]),
        "highest": float(step.max()),
        "highest_ramp": float(ramp.max()),
    }


def used_inputs(evidence: Evidence, scenario: str, design: str) -> float:
    """Return the largest share that the nominal input takes of its bound over a nominal flight."""
    flown = evidence.design(design).flown
    law = FamilyLaw(nominal_data(flown))
    planned = np.abs([law.step(deviation).input for deviation in evidence.flights[scenario].deviation])
    return float((planned / flown.nominal_input_bound).max())


def nominal_inputs(evidence: Evidence) -> dict[str, Any]:
    """Return the share used of the nominal inputs' bounds, and the velocity error (ft/s) with a single K."""
    single = abs(evidence.changed("case1_single_k")["velocity_end_error"])
    return {"used": used_inputs(evidence, "case1", "baseline"), "single": to_paper(single, "m/s")[0]}


def symmetric(evidence: Evidence) -> dict[str, Any]:
    """Return the distances of the centres of W and Z from zero, relative to their half-widths."""
    tube = evidence.design("baseline").flown.tube
    assert tube is not None
    channels = evidence.design("baseline").certificate["tube"]["disturbance"]["channels"]
    off = {
        name: abs(bounds["upper"] + bounds["lower"]) / (bounds["upper"] - bounds["lower"])
        for name, bounds in channels.items()
    }
    name = max(off, key=lambda channel: off[channel])
    return {
        "channel": name.replace("_", " "),
        "disturbance": off[name],
        "set": float(np.abs(tube.centre / tube.half_width).max()),
    }


def _levels(evidence: Evidence, scenario: str) -> np.ndarray:
    """Return the level (n) of x_n in the ellipsoid of the outermost gain over a nominal flight."""
    outermost = evidence.design("baseline").flown.nominal_ellipsoids[0]
    rigid = evidence.flights[scenario].deviation[:, : len(outermost)]
    return np.asarray(np.einsum("ki,ij,kj->k", rigid, outermost, rigid))
