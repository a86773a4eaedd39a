"""The range in which the model means anything."""

from __future__ import annotations

import math
from typing import Any

from hsv.compiled import njit_in_flight

FOOT = 0.3048
"""Metres in a foot, by definition."""


@njit_in_flight()
def in_model_range(x: Any, angle_limit: Any) -> Any:
    """Tell whether the state ``x`` (9) is finite and its angles (rad) are within the range of the curve fits."""
    inside = (abs(x[2]) <= angle_limit) & (abs(x[3]) <= angle_limit) & (x[1] > 0.0)
    for i in range(len(x)):
        inside = inside & math.isfinite(x[i])
    return inside
