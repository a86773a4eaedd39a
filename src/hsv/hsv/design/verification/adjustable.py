"""Checks of the adjustable design: Z at tau = 1, what the relaxed bounds follow from, the coupled vehicle's poles."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.nominal_gain import certified_cost
from hsv.design.baseline import nominal_problem
from hsv.design.coupled_poles import largest_real_parts
from hsv.design.factor_range import relaxed_bound
from hsv.design.sets.ellipsoid_set import EllipsoidSet, vertex_residuals
from hsv.design.tightening import tighten
from hsv.design.verification.checks import Check, Subject, above, at_most, same, same_parameter
from hsv.design.verification.invariant_set import stored_set
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim


def adjustable_checks(subject: Subject) -> Iterable[Check]:
    """Recompute Z at tau = 1, the bounds that follow from it, and the poles of the coupled vehicle."""
    design, stored = subject.design, subject.certificate.get("adjustable")
    if stored is None:
        return
    one = replace(design, tau=np.ones(N_RIGID), tau_minimum=np.ones(N_RIGID))
    complete = yield from _set_checks("Z at tau = 1", subject, one, stored["complete"])
    incomplete = yield from _set_checks("Z' of the unrelaxed plan", subject, design, stored["incomplete"])
    tau = np.append(design.tau_minimum, np.full(len(complete.half_width) - N_RIGID, design.tau_minimum[-1]))
    yield same("tau Z, half-widths", stored["scaled_half_width"], tau * complete.half_width, "half-widths")
    yield same_parameter(subject, "feedback.tau", design.tau, stored["tau"])
    inputs = subject.inputs
    target = inputs.nominal.target
    trimmed = trim(subject.vehicle.decoupled, target.altitude, target.velocity).input
    bounds = (tighten(found, design.input_minimum, design.input_maximum) for found in (complete, incomplete))
    relaxed = relaxed_bound(inputs.nominal.input_bound.array(), trimmed, *bounds)
    yield same("(52) bounds of |u_n|", stored["input_bound"], relaxed, "relaxed bounds")
    single = stored["single_gain"]
    Q = np.array(single["Q"])
    K = np.linalg.solve(Q, np.array(single["Y"]).T).T
    gamma, _ = certified_cost(nominal_problem(inputs, design.polytope, relaxed), K, Q, "single nominal gain K'")
    yield same("certified cost of the single K'", gamma, single["certified_gamma"], "certified costs")
    full = stored["full_state"]
    parts = largest_real_parts(design, subject.vehicle, np.array(full["gain"]), (target.altitude, target.velocity))
    for coupling, value in parts["structured"].items():
        yield at_most(f"rightmost pole of the coupled vehicle, {coupling} coupling", value, 0.0)
    derived = parts["full_state"]["derived"]
    yield above("the same with the full-state F', derived coupling", derived, 0.0)
    yield same("its value as certified", derived, full["largest_real_part"]["full_state"]["derived"], "rightmost poles")


def _set_checks(
    name: str, subject: Subject, design: ControlDesign, stored: dict[str, Any]
) -> Generator[Check, None, EllipsoidSet]:
    found = stored_set(design, subject.vehicle, stored)
    residuals = vertex_residuals(found.problem, found.centre, found.Q, found.contraction, found.multipliers)
    yield above(f"{name}, invariance, smallest eigenvalue over the vertices", residuals.min(), 0.0)
    yield same(f"{name}, half-widths from Q", stored["invariant_set"]["half_width"], found.half_width, "half-widths")
    bounds, kept = tighten(found, design.input_minimum, design.input_maximum), stored["tightening"]
    yield same(f"{name}, what it leaves of the inputs, lower", kept["lower"], bounds.lower, "tightened bounds")
    yield same(f"{name}, what it leaves of the inputs, upper", kept["upper"], bounds.upper, "tightened bounds")
    return found
