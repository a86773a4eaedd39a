"""Flight envelope, input limits and the range in which the model means anything (paper section 5.1), in SI."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

FOOT = 0.3048
"""Metres in a foot, by definition."""

ALTITUDE_RANGE = (25908.0, 26365.2)
"""m: 85000 ft to 86500 ft; the paper prints 865000 ft as the upper end."""

VELOCITY_RANGE = (2346.96, 2529.84)
"""m/s: 7700 ft/s to 8300 ft/s"""

INPUT_MINIMUM = np.array([0.0, -math.radians(30.0)])
INPUT_MAXIMUM = np.array([1.5, math.radians(30.0)])
"""Fuel equivalence ratio and elevator deflection (rad); the paper's U (eq. 29)."""

ANGLE_LIMIT = math.radians(30.0)
"""|angle of attack| and |pitch angle| (rad) beyond which the curve fits mean nothing: the flight has diverged."""


@njit(cache=True)
def in_model_range(x: np.ndarray) -> bool:
    """Tell whether the state ``x`` (9) is finite and its angles are within the range of the curve fits."""
    for value in x:
        if not math.isfinite(value):
            return False
    return abs(x[2]) <= ANGLE_LIMIT and abs(x[3]) <= ANGLE_LIMIT and x[1] > 0.0
