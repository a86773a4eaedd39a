"""Checks of the adjustable factor that a flight rests on: one Lyapunov function for every factor that is certified."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hsv.design.factor_range import certified_loops, room_at_one
from hsv.design.lyapunov import lyapunov_residuals
from hsv.design.verification.checks import Check, Subject, above, required, same, same_parameter
from hsv.model.signals import N_RIGID


def factor_checks(subject: Subject) -> Iterable[Check]:
    """Recompute the basis of the range of the tube factor; for a design without one the range is 1 alone."""
    design, stored = subject.design, subject.certificate.get("adjustable")
    filtered = stored is not None
    yield required(Check("nominal.filtered", str(design.filtered), str(filtered), design.filtered == filtered))
    if stored is None:
        yield required(same_parameter(subject, "feedback.tau_minimum", design.tau_minimum, np.ones(N_RIGID)))
        return
    yield required(same_parameter(subject, "feedback.tau_minimum", design.tau_minimum, stored["tau_minimum"]))
    effectiveness = subject.certificate["inputs"]["disturbance"]["elevator_effectiveness"]
    residuals = lyapunov_residuals(
        certified_loops(design, subject.vehicle, effectiveness),
        np.array(stored["lyapunov"]["N"]),
        "common Lyapunov function",
    )
    yield required(above("common Lyapunov function, smallest eigenvalue", residuals.min(), 0.0))
    yield same("its eigenvalues as certified", residuals, stored["lyapunov"]["lmi_smallest_eigenvalues"], "eigenvalues")
    room = room_at_one(design, subject.vehicle, subject.certificate["tube"])
    yield same("room of the nominal plan at tau = 1", stored["room_at_one"], room, "room of plans")
    yield required(above("least room of the nominal plan at tau = 1", float(room.min()), 0.0))
