"""Arithmetic with the same bits on every processor: elementary functions and linear equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hsv.base.parameters import Parameter
from hsv.core import doubles, lib

tangent: Callable[[float], float] = lib.hsv_tangent
"""Return the tangent of an angle (rad) up to 1e5 in magnitude."""

arcsine: Callable[[float], float] = lib.hsv_arcsine
"""Return the angle (rad) from -pi / 2 to pi / 2 whose sine is the argument, from -1 to 1."""

exponential: Callable[[float], float] = lib.hsv_exponential
"""Return the exponential of a number up to 700 in magnitude."""

logarithm: Callable[[float], float] = lib.hsv_logarithm
"""Return the natural logarithm of a normal positive number."""


def of_each(function: Callable[[float], float], values: Any) -> np.ndarray:
    """Return the results of ``function`` for each of ``values``, both of shape (n,)."""
    return np.array([function(value) for value in np.asarray(values, float).tolist()])


def solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return X (n, m) with A X = b for ``A`` (n, n) and ``b`` (n, m), by elimination with partial pivoting.

    If a pivot is zero, the result is not finite.

    Raises:
        ValueError: The shapes do not match.
    """
    left, right = np.array(A, float, order="C"), np.array(b, float, order="C")
    n, m = right.shape
    lib.hsv_solve(n, m, doubles(left, n, n), doubles(right))
    return right


SEED_PARAMETER = Parameter("seed", 0, "key of all random numbers of the flight", "", 0, 2**53)
"""Seed of a flight, at most 2^53, which all file formats represent exactly."""

LARGEST = float(np.sqrt(106.0 * 0.6931471805599453))
"""Largest random normal number, 8.57: the argument of the logarithm in Box and Muller's method is at least 2^-53."""
