"""Claims of the adjustable factor: one Lyapunov function for all certified loops, Z and the bounds that follow."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from hsv.design.coupled_poles import largest_real_parts
from hsv.design.factor import certified_loops, relaxed_bound, room_at_one
from hsv.design.lyapunov import lyapunov_residuals
from hsv.design.sets.ellipsoid_set import vertex_residuals
from hsv.design.tightening import tighten
from hsv.design.verification.claims import Claim, Subject, above, at_most, required, same
from hsv.design.verification.invariant_set import stored_set
from hsv.vehicle.dynamics import N_RIGID
from hsv.vehicle.parameters import vehicle_parameters
from hsv.vehicle.trim import trim


def factor_claims(subject: Subject) -> Iterable[Claim]:
    """Recompute what the range of the factor rests on; that of a design without one is 1 alone."""
    design, stored = subject.design, subject.certificate.get("adjustable")
    if stored is None:
        yield required(same("feedback.tau_minimum", design.tau_minimum, np.ones(N_RIGID)))
        return
    yield required(same("feedback.tau_minimum", design.tau_minimum, stored["tau_minimum"]))
    effectiveness = subject.certificate["inputs"]["disturbance"]["elevator_effectiveness"]
    residuals = lyapunov_residuals(
        certified_loops(design, effectiveness), np.array(stored["lyapunov"]["N"]), "common Lyapunov function"
    )
    yield required(above("common Lyapunov function, smallest eigenvalue", residuals.min(), 0.0))
    yield same("its eigenvalues as certified", residuals, stored["lyapunov"]["lmi_smallest_eigenvalues"], 1e-6, 1e-9)
    room = room_at_one(design, subject.certificate["tube"])
    yield same("room of the nominal plan at tau = 1", stored["room_at_one"], room, 1e-6, 1e-9)
    yield required(above("least room of the nominal plan at tau = 1", float(room.min()), 0.0))


def adjustable_claims(subject: Subject) -> Iterable[Claim]:
    """Recompute Z at tau = 1, what the relaxed bounds follow from it, and the poles of the coupled vehicle."""
    design, stored = subject.design, subject.certificate.get("adjustable")
    if stored is None:
        return
    one = replace(design, tau=np.ones(N_RIGID), tau_minimum=np.ones(N_RIGID))
    complete = stored_set(one, stored["complete"])
    residuals = vertex_residuals(
        complete.problem, complete.centre, complete.Q, complete.contraction, complete.multipliers
    )
    yield above("Z at tau = 1, invariance, smallest eigenvalue over the vertices", residuals.min(), 0.0)
    half_width = stored["complete"]["invariant_set"]["half_width"]
    yield same("Z at tau = 1, half-widths from Q", half_width, complete.half_width)
    tau = np.append(design.tau_minimum, np.full(len(half_width) - N_RIGID, design.tau_minimum[-1]))
    yield same("tau Z, half-widths", stored["scaled_half_width"], tau * complete.half_width)
    bounds, kept = tighten(complete, design.input_minimum, design.input_maximum), stored["complete"]["tightening"]
    yield same("U minus F Z at tau = 1, lower", kept["lower"], bounds.lower)
    yield same("U minus F Z at tau = 1, upper", kept["upper"], bounds.upper)
    wider = {side: np.array(stored["incomplete_bounds"][side]) for side in ("lower", "upper")}
    target = subject.inputs.nominal.target
    trimmed = trim(vehicle_parameters("decoupled"), target.altitude, target.velocity).input
    relaxed = relaxed_bound(subject.inputs.nominal.input_bound.array(), trimmed, bounds, replace(bounds, **wider))
    yield same("(52) bounds of |u_n|", stored["input_bound"], relaxed)
    full = stored.get("full_state")
    if full:
        parts = largest_real_parts(design, np.array(full["gain"]), (target.altitude, target.velocity))
        for coupling, value in parts["structured"].items():
            yield at_most(f"rightmost pole of the coupled vehicle, {coupling} coupling", value, 0.0)
        derived = parts["full_state"]["derived"]
        yield above("the same with the full-state F', derived coupling", derived, 0.0)
        yield same("its value as certified", derived, full["largest_real_part"]["full_state"]["derived"], 1e-6)
