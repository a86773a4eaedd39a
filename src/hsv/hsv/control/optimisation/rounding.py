"""Rounding of what one stage of a design hands to the next, to the digits that mean something."""

from __future__ import annotations

from typing import Any

import numpy as np

VERTEX_DIGITS = 12
"""Digits kept of vertices, below the scales of the model: two processors agree on ten, but the slow modes in the Bode
plot need twelve. Entries that are zero in the physical model are below 1e-14 and become zero."""

GAIN_DIGITS = 6
"""Digits kept of gains, below the scales of their problem; processors agree on eight."""

MATRIX_DIGITS = 11
"""Digits kept of ellipsoids, their centres and multipliers, below their own sizes. Processors agree on eight, but an
ellipsoid must also be invariant and nested in its thinnest direction, where its entries cancel."""

BOUND_DIGITS = 6
"""Digits kept of bounds of disturbances and inputs."""


def rounded(values: np.ndarray, size: Any, digits: int) -> np.ndarray:
    """Return ``values`` as decimal numbers with ``digits`` digits below the leading one of each ``size``."""
    values = np.asarray(values, float)
    leading = np.floor(np.log10(np.broadcast_to(np.asarray(size, float), values.shape))).astype(int)
    flat = [round(v, digits - k) for v, k in zip(values.ravel().tolist(), leading.ravel().tolist(), strict=True)]
    # Without negative zeros.
    return np.array(flat).reshape(values.shape) + 0.0


def rounded_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return a positive definite matrix (n, n) rounded, below the roots of its diagonal."""
    root = np.sqrt(np.diag(matrix))
    return rounded(0.5 * (matrix + matrix.T), np.outer(root, root), MATRIX_DIGITS)


def outward(values: np.ndarray) -> np.ndarray:
    """Return ``values`` rounded away from zero to :data:`BOUND_DIGITS` significant digits.

    A value that exceeds such a number by less than 1e-12 of itself becomes that number.
    """
    values = np.asarray(values, float)
    size = np.where(values == 0.0, 1.0, np.abs(values))
    quantum = 10.0 ** (np.floor(np.log10(size)) - BOUND_DIGITS + 1)
    # The margin is for a value that is a multiple but for the rounding of the division.
    multiples = np.ceil(np.abs(values) / quantum * (1.0 - 1e-12))
    return rounded(np.sign(values) * multiples * quantum, size, BOUND_DIGITS)
