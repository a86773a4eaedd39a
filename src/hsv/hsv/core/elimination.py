"""Small systems of linear equations, solved the same way on every machine; see ``core/trim.h``."""

from __future__ import annotations

import numpy as np

from hsv.core import doubles, lib


def solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return X (n, m) with A X = b for ``A`` (n, n) and ``b`` (n, m), by elimination with partial pivoting.

    Where ``A`` is singular, the result is not finite.

    Raises:
        ValueError: Other shapes.
    """
    left, right = np.array(A, float, order="C"), np.array(b, float, order="C")
    n, m = right.shape
    lib.hsv_solve(n, m, doubles(left, n, n), doubles(right))
    return right
