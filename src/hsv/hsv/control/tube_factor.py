"""The adjustable factor tau of the tube's feedback (paper eq. 54): its values, its certified range, its changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, check_all
from hsv.base.timing import first_step
from hsv.model.dynamics import N_RIGID

FACTORS = "one value, or one for each rigid state"

TAU = Parameter("feedback.tau", [1.0], f"adjustable factor of the feedback gain: {FACTORS}", "", 0.0, 1.0)
TAU_MINIMUM = Parameter("feedback.tau_minimum", [1.0], f"least certified factor, up to 1: {FACTORS}", "", 0.0, 1.0)

_SAME_SHARE = 1e-9
"""Difference of two shares that is rounding."""

TAU_CHANGE_PARAMETERS = (
    Parameter("tau_change.starts", [], "simulated times at which feedback.tau changes, in order", "s", 0.0),
    Parameter("tau_change.values", [], f"factor from then on: {FACTORS}, a change after the other", "", 0.0, 1.0),
)


def rigid_factors(values: Sequence[float], name: str) -> np.ndarray:
    """Return the factor of each rigid state (5) from one ``values`` for all or five.

    Raises:
        ParameterError: Another number of them, or one that is not above zero.
    """
    tau = np.array(values, float)
    if tau.shape not in ((1,), (N_RIGID,)):
        raise ParameterError(f"parameter {name}: {tau.size} values, expected 1 or {N_RIGID}")
    if not np.all(tau > 0.0):
        raise ParameterError(f"parameter {name} = {tau.tolist()}: expected values above zero")
    return np.broadcast_to(tau, N_RIGID).copy()


def certified(values: Sequence[float], minimum: np.ndarray, name: str = TAU.name) -> np.ndarray:
    """Return the factors (5) in ``values`` if they lie on the way from their certified ``minimum`` (5) to 1.

    Between the two closed loops everything is certified, by one Lyapunov function; a factor that is small in one
    dimension and large in another is not between them.

    Raises:
        ParameterError: Names the value that does not, and the range.
    """
    tau = rigid_factors(values, name)
    outside = np.flatnonzero(~((tau >= minimum) & (tau <= 1.0)))
    # One value for a range that differs by dimension: the range of any one of them would mislead.
    blurred = len(values) == 1 and np.ptp(minimum) > 0.0
    for index in [] if blurred else outside[:1]:
        place = f"[{index}]" if len(values) > 1 else ""
        low = float(minimum[index])
        expected = f"{low:g} to 1, the certified range" if low < 1.0 else "1: no other factor is certified"
        raise ParameterError(f"parameter {name}{place} = {tau[index]:g}: expected {expected} (feedback.tau_minimum)")
    lessened = minimum < 1.0
    share = (1.0 - tau[lessened]) / (1.0 - minimum[lessened])
    if outside.size or (share.size and np.ptp(share) > _SAME_SHARE):
        raise ParameterError(
            f"parameter {name} = {tau.tolist()}: expected factors that are all the same share of the way from 1 to "
            f"{compact(minimum).tolist()} (feedback.tau_minimum), no others are certified"
        )
    return tau


def compact(tau: np.ndarray) -> np.ndarray:
    """Return the one value of ``tau`` (5) if all are equal, else all five."""
    return tau[:1].copy() if np.all(tau == tau[0]) else tau.copy()


def scheduled_changes(values: Mapping[str, Any], minimum: np.ndarray, period: float) -> list[tuple[int, np.ndarray]]:
    """Return first step and factors (5) of each change in :data:`TAU_CHANGE_PARAMETERS`.

    Raises:
        ParameterError: Arrays that do not match, times that decrease, or a factor that is not certified.
    """
    v = check_all(TAU_CHANGE_PARAMETERS, values)
    starts, flat = v["tau_change.starts"], v["tau_change.values"]
    if len(flat) not in (len(starts), N_RIGID * len(starts)):
        raise ParameterError(
            f"parameter tau_change.values: {len(flat)} values, expected {len(starts)} or {N_RIGID * len(starts)}"
        )
    if starts != sorted(starts):
        raise ParameterError(f"parameter tau_change.starts = {starts}: expected times that do not decrease")
    rows = np.reshape(flat, (len(starts), -1)).tolist() if starts else []
    return [
        (first_step(start, period), certified(row, minimum, f"tau_change.values[{index}]"))
        for index, (start, row) in enumerate(zip(starts, rows, strict=True))
    ]


def change_parameters(changes: Sequence[tuple[int, np.ndarray]], period: float) -> dict[str, list[float]]:
    """Return ``changes`` as :data:`TAU_CHANGE_PARAMETERS`."""
    return {
        "tau_change.starts": [start * period for start, _ in changes],
        "tau_change.values": [float(value) for _, tau in changes for value in tau],
    }
