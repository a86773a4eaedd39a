"""Elementary functions with the same bits on every processor; see ``core/elementary.h``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hsv.core import ffi, lib


def sine_cosine(x: float) -> tuple[float, float]:
    """Return the sine and the cosine of ``x`` (rad), up to 1e5 in magnitude."""
    pair = ffi.new("double[2]")
    lib.hsv_sine_cosine(x, pair, pair + 1)
    return pair[0], pair[1]


tangent: Callable[[float], float] = lib.hsv_tangent
"""Of an angle (rad) up to 1e5 in magnitude."""

arcsine: Callable[[float], float] = lib.hsv_arcsine
"""Angle (rad) from -pi / 2 to pi / 2 whose sine is given, from -1 to 1."""

arctangent2: Callable[[float, float], float] = lib.hsv_arctangent2
"""Angle (rad) from -pi to pi of the point (x, y), given y first; each zero or of magnitude 1e-140 to 1e140."""

exponential: Callable[[float], float] = lib.hsv_exponential
"""Of a number up to 700 in magnitude."""

logarithm: Callable[[float], float] = lib.hsv_logarithm
"""The natural one of a normal positive number."""


def of_each(function: Callable[[float], float], values: Any) -> np.ndarray:
    """Return a ``function`` of one number of each of ``values`` (n)."""
    return np.array([function(value) for value in np.asarray(values, float).tolist()])
