"""The linear sampled loops of Case 1: growth at its start and target, before and after its fault, over the coupling."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from hsv.base.units import FOOT
from hsv.certificate.loops import Feedback
from hsv.model.dynamics import VehicleParameters
from hsv.model.vehicle import load_vehicle

START = (85500.0 * FOOT, 7900.0 * FOOT)
TARGET = (86100.0 * FOOT, 8150.0 * FOOT)
"""Altitude (m) and velocity (m/s) at which Case 1 starts and ends."""

EFFECTIVENESS = (1.0, 0.9)
"""Effectiveness of the elevator before and after Case 1's fault."""

COUPLING_SCALES = tuple(0.05 * step for step in range(26))
"""Multiples kappa of the derived coupling, between which limits of stability are bracketed."""

Corners = Sequence[Mapping[str, float]]
"""Relative changes of the vehicle's parameters, one mapping per vehicle."""

NOMINAL: Corners = ({},)


def growths(feedback: Feedback, vehicle: VehicleParameters, over: Corners) -> np.ndarray:
    """Return, by vehicle, the largest growth (1/s) at Case 1's start and target, before and after its fault."""
    return np.array(
        [
            max(
                feedback.around(vehicle.perturbed(corner), point, share).growth
                for point in (START, TARGET)
                for share in EFFECTIVENESS
            )
            for corner in over
        ]
    )


def largest_growth(feedback: Feedback, vehicle: VehicleParameters, over: Corners = NOMINAL) -> float:
    """Return the largest of the :func:`growths` (1/s) of the vehicles ``over``."""
    return float(growths(feedback, vehicle, over).max())


def critical_coupling(feedback: Feedback, over: Corners = NOMINAL) -> float | None:
    """Return the least multiple kappa of the derived coupling at which a vehicle of ``over`` becomes unstable.

    0: one is unstable even without coupling. None: all are stable at all :data:`COUPLING_SCALES`.
    """
    return stability_limit(lambda kappa: largest_growth(feedback, load_vehicle().coupled(kappa), over), COUPLING_SCALES)


def stability_limit(growth: Callable[[float], float], along: Sequence[float]) -> float | None:
    """Return the first scalar, in the order of ``along``, at which a loop becomes unstable.

    Args:
        growth: Largest real part (1/s) of a loop's poles as a function of a scalar, such as kappa.
        along: Values of the scalar, increasing or decreasing, so dense that no two crossings lie between neighbours.

    Returns:
        ``along[0]`` if the loop is unstable there; None if it is stable at all values of ``along``.
    """
    if growth(along[0]) >= 0.0:
        return float(along[0])
    for before, value in pairwise(along):
        if growth(value) >= 0.0:
            return float(brentq(growth, before, value, xtol=1e-6 * abs(value - before)))
    return None
