"""Permitted range of the tube factor (paper section 4.3): certified loops, bounds of K', margin of the nominal inputs.

Nothing here needs a solver: a node recomputes it before it flies.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.control.optimisation import BOUND_DIGITS, rounded
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem, error_system
from hsv.design.sets.ellipsoid_set import from_report
from hsv.design.tightening import TightenedInputs, tighten
from hsv.design.tube_problem import bounding_factors, channel_model, tube_problem
from hsv.model.signals import N_RIGID
from hsv.model.vehicle import Vehicle


def certified_loops(design: ControlDesign, vehicle: Vehicle, effectiveness: float) -> np.ndarray:
    """Return the closed loops (r, n, n) of error and filter that must share a Lyapunov function.

    Vertices x adjustable factors (the least, 1) x elevator effectiveness (1, ``effectiveness``).
    """
    return np.concatenate(
        [
            _system(design, vehicle, factor, share).A
            for factor in bounding_factors(design)
            for share in (1.0, effectiveness)
        ]
    )


def relaxed_bound(
    bound: np.ndarray, trim_input: np.ndarray, complete: TightenedInputs, incomplete: TightenedInputs
) -> np.ndarray:
    """Return the bounds (2) of |u_n| in (52): ``bound``, grown as U minus F' Z' is wider than U minus F Z.

    Both are compared about the target's ``trim_input`` (2), on the side with less room (paper eq. 53), and rounded.

    Raises:
        DesignError: No room at all, at tau = 1 or at the factor.
    """
    before, after = complete.symmetric(trim_input), incomplete.symmetric(trim_input)
    for name, room in (("U minus F Z at tau = 1", before), ("U minus F' Z'", after)):
        if not room.min() > 0.0:
            raise DesignError(f"{name}: {room.tolist()} about the trim, expected room above zero")
    return rounded(bound * after / before, 1.0, BOUND_DIGITS)


def room_at_one(design: ControlDesign, vehicle: Vehicle, tube: dict[str, Any]) -> np.ndarray:
    """Return the least room (2) that the plan of the certificate ``tube`` leaves where the factor is set to 1.

    Raises:
        DesignError: The feedback leaves nothing of an input there.
    """
    one = replace(design, tau_minimum=np.ones(N_RIGID))
    problem = tube_problem(one, vehicle, DisturbanceSet.from_report(tube["disturbance"]["channels"]))
    bounds = tighten(from_report(problem, tube["invariant_set"]), design.input_minimum, design.input_maximum)
    plan = tube["tightening"]["plan"]
    return np.asarray(bounds.margins(np.array(plan["lowest"]), np.array(plan["highest"])).min(axis=1))


def _system(design: ControlDesign, vehicle: Vehicle, factor: np.ndarray, effectiveness: float) -> ErrorSystem:
    polytope, model = design.polytope, channel_model(design, vehicle)
    gain = design.feedback_gain[:, :N_RIGID] * factor
    return error_system(polytope.A, polytope.B * np.array([1.0, effectiveness]), gain, model.notch, model.columns)
