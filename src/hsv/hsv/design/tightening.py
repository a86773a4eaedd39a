"""Tightened bounds of the total nominal input: U minus F Z (paper eq. 30, with F' and Z' eq. 53).

    u_n + u_r in {u: minimum - min F e <= u <= maximum - max F e over e in c + Z}                                   (30)

U is not symmetric about trim, and the tube c + Z not about zero, so the two sides of an input have different margins.
To F e over c + Z, the code adds the feedback due to filtering the nominal pitch rate and, if the design includes
actuators, that due to their lag behind the plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import PLAN_SHIFT, PlanBounds
from hsv.design.sets.invariant_set import OUTWARD, InvariantSet
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS


@dataclass(frozen=True)
class TightenedInputs:
    """Minimum and maximum, shape (2,) each, of the nominal input u_n + u_r that leave room for the feedback, SI."""

    lower: np.ndarray
    upper: np.ndarray

    def margins(self, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
        """Return the margins, shape (2, 2), from a plan's extremes to the bounds: a row per input, lower first, SI."""
        return np.stack((lowest - self.lower, self.upper - highest), axis=1)

    def symmetric(self, trim_input: np.ndarray) -> np.ndarray:
        """Return the |u_n| permitted in eq. 35, shape (2,): the distance of ``trim_input`` to the nearer bound."""
        return np.minimum(trim_input - self.lower, self.upper - trim_input)


def tighten(
    found: InvariantSet, minimum: np.ndarray, maximum: np.ndarray, lag: tuple[np.ndarray, np.ndarray] | None = None
) -> TightenedInputs:
    """Return U minus F Z (paper eq. 30, eq. 53) for inputs U from ``minimum`` to ``maximum``.

    ``lag``: smallest and largest additional feedback, shape (2,) each, in response to the actuators' lag behind the
    plan; None: ideal actuators.

    Raises:
        DesignError: The feedback needs the whole range of an input.
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
    """Return U minus F Z without checking that it is not empty; the arguments are those of :func:`tighten`."""
    system, disturbance = found.problem.system, found.problem.disturbance
    middle = system.F @ found.centre + system.F_d @ disturbance.centre
    half = OUTWARD * (found.input_range + np.abs(system.F_d) @ disturbance.half_width)
    bounds = TightenedInputs(minimum - middle + half, maximum - middle - half)
    return bounds if lag is None else TightenedInputs(bounds.lower - lag[0], bounds.upper - lag[1])


def plan_bounds(bounds: TightenedInputs, lowest: np.ndarray, highest: np.ndarray) -> PlanBounds:
    """Return bounds for other nominal plans, within which the disturbance set should hold; flights have to confirm it.

    Another plan may hold a large input for a long time that the certified plans reach only briefly. Its input range is
    therefore the range in the certified plans, both ends of which are lowered by :data:`hsv.control.design.PLAN_SHIFT`
    of its width. The range of the pitch acceleration is unchanged.

    Args:
        bounds: The tightened bounds.
        lowest: Smallest u_n + u_r by input, then smallest nominal pitch acceleration, of the certified plans, SI.
        highest: Their largest values.
    """
    shift = PLAN_SHIFT * (highest - lowest)
    shift[2] = 0.0
    return PlanBounds(bounds.lower, bounds.upper, lowest - shift, highest - shift)


def check_plan(bounds: TightenedInputs, lowest: np.ndarray, highest: np.ndarray) -> dict[str, Any]:
    """Return the margins of the nominal plan to the tightened bounds, for JSON.

    Args:
        bounds: The tightened bounds.
        lowest: Smallest u_n + u_r of the plan, by input.
        highest: Largest u_n + u_r of the plan, by input.

    Raises:
        DesignError: The plan exceeds a bound; the message states by how much.
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
        "margin_to_lower": margins[:, 0].tolist(),
        "margin_to_upper": margins[:, 1].tolist(),
    }


def _amount(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
