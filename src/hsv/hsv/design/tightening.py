"""Tightened bounds of the nominal input: U minus F Z, per side, with the trim (paper eq. 30, with F' and Z' eq. 53).

    u_n + u_r in {u: minimum - min F e <= u <= maximum - max F e over e in c + Z}                                   (30)

U is not symmetric about trim and the tube not about zero, so every side has its own bound. The feedback consists of F e
over c + Z, of a part from filtering the nominal pitch rate, and of the response to the lag of the plan where the design
knows its actuators.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import PlanBounds
from hsv.design.sets.invariant_set import InvariantSet
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS

_KEPT_OFF = 0.05
"""Share of the input ranges of the certified plans; without it the acceleration channel reaches 1.02 of its bound."""


@dataclass(frozen=True)
class TightenedInputs:
    """Minimum and maximum (2 each) of the nominal input u_n + u_r that leave room for the feedback, SI."""

    lower: np.ndarray
    upper: np.ndarray

    def margins(self, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
        """Return the room (2 inputs, lower and upper side) that a plan between these inputs leaves."""
        return np.stack((lowest - self.lower, self.upper - highest), axis=1)

    def symmetric(self, trim_input: np.ndarray) -> np.ndarray:
        """Return the largest symmetric bound (2) of |u_n| about the trim input, as (35) takes it."""
        return np.minimum(trim_input - self.lower, self.upper - trim_input)


def tighten(
    found: InvariantSet, minimum: np.ndarray, maximum: np.ndarray, lag: tuple[np.ndarray, np.ndarray] | None = None
) -> TightenedInputs:
    """Return U minus F Z (paper eq. 30, eq. 53) for U between ``minimum`` and ``maximum`` (2).

    ``lag``: least and largest feedback (2 each) to the lag of the plan.

    Raises:
        DesignError: Nothing is left of an input.
    """
    bounds = left_by(found, minimum, maximum, lag)
    for name, unit, low, high in zip(INPUT_NAMES, INPUT_UNITS, bounds.lower, bounds.upper, strict=True):
        if not low < high:
            raise DesignError(
                f"tightening: the feedback needs {_amount(low - high, unit)} more of {name} than there is, "
                "expected room for the nominal input"
            )
    return bounds


def left_by(
    found: InvariantSet, minimum: np.ndarray, maximum: np.ndarray, lag: tuple[np.ndarray, np.ndarray] | None = None
) -> TightenedInputs:
    """Return U minus F Z, even if it is empty; arguments as for :func:`tighten`."""
    system, disturbance = found.problem.system, found.problem.disturbance
    middle = system.F @ found.centre + system.F_d @ disturbance.centre
    half = found.feedback + np.abs(system.F_d) @ disturbance.half_width
    bounds = TightenedInputs(minimum - middle + half, maximum - middle - half)
    return bounds if lag is None else TightenedInputs(bounds.lower - lag[0], bounds.upper - lag[1])


def plan_bounds(bounds: TightenedInputs, lowest: np.ndarray, highest: np.ndarray) -> PlanBounds:
    """Return bounds for another nominal plan within which the disturbance set should hold; flights have to show it.

    Another plan may hold for a long time inputs that the certified plans only touch. It therefore stays below their
    largest inputs, and may go as far below their smallest ones. The pitch acceleration has their bounds.

    Args:
        bounds: The tightened bounds.
        lowest: (3) least u_n + u_r and pitch acceleration of the certified plans.
        highest: (3) the largest.
    """
    shift = _KEPT_OFF * (highest - lowest)
    shift[2] = 0.0
    return PlanBounds(bounds.lower, bounds.upper, lowest - shift, highest - shift)


def check_plan(bounds: TightenedInputs, lowest: np.ndarray, highest: np.ndarray) -> dict[str, Any]:
    """Return the room that the nominal plan leaves, for JSON.

    Args:
        bounds: The tightened bounds.
        lowest: (2) least u_n + u_r of the plan over all its steps.
        highest: (2) the largest.

    Raises:
        DesignError: The plan does not fit; the message says by how much.
    """
    margins = bounds.margins(lowest, highest)
    for name, unit, sides in zip(INPUT_NAMES, INPUT_UNITS, margins, strict=True):
        if sides.min() < 0.0:
            side = ("lower", "upper")[int(np.argmin(sides))]
            raise DesignError(
                f"tightening: the nominal plan passes the {side} tightened bound of {name} "
                f"by {_amount(-sides.min(), unit)}, expected it inside"
            )
    return {
        "lowest": lowest.tolist(),
        "highest": highest.tolist(),
        "margin_to_lower": margins[:, 0].tolist(),
        "margin_to_upper": margins[:, 1].tolist(),
    }


def _amount(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
