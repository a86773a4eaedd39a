"""Small systems of linear equations, solved the same way on every machine, compiled.

LAPACK chooses its kernels, and with them the order of its sums, by the processor.
"""

from __future__ import annotations

import numpy as np

from hsv.compiled import njit


@njit(cache=True, error_model="numpy")
def solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return X (n, m) with A X = b for ``A`` (n, n) and ``b`` (n, m), by elimination with partial pivoting.

    Where ``A`` is singular the result is not finite.
    """
    n, m = b.shape
    left, right = A.copy(), b.copy()
    for column in range(n):
        pivot = column
        for row in range(column + 1, n):
            if abs(left[row, column]) > abs(left[pivot, column]):
                pivot = row
        if pivot != column:
            for j in range(n):
                left[column, j], left[pivot, j] = left[pivot, j], left[column, j]
            for j in range(m):
                right[column, j], right[pivot, j] = right[pivot, j], right[column, j]
        for row in range(column + 1, n):
            share = left[row, column] / left[column, column]
            for j in range(column, n):
                left[row, j] -= share * left[column, j]
            for j in range(m):
                right[row, j] -= share * right[column, j]
    for row in range(n - 1, -1, -1):
        for j in range(m):
            for k in range(row + 1, n):
                right[row, j] -= left[row, k] * right[k, j]
            right[row, j] /= left[row, row]
    return right
