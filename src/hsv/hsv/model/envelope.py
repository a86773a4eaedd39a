"""The range in which the model means anything."""

from __future__ import annotations

import numpy as np

from hsv.core import doubles, lib, vector

FOOT = 0.3048
"""Metres in a foot, by definition."""


def in_model_range(x: np.ndarray, angle_limit: float) -> bool:
    """Return whether the state ``x`` (9) is finite and its angles (rad) are within the range of the curve fits."""
    return bool(lib.hsv_in_model_range(doubles(vector(x), 9), angle_limit))
