"""The range in which the model means anything."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

FOOT = 0.3048
"""Metres in a foot, by definition."""


@njit(cache=True)
def in_model_range(x: np.ndarray, angle_limit: float) -> bool:
    """Tell whether the state ``x`` (9) is finite and its angles (rad) are within the range of the curve fits."""
    for value in x:
        if not math.isfinite(value):
            return False
    return abs(x[2]) <= angle_limit and abs(x[3]) <= angle_limit and x[1] > 0.0
