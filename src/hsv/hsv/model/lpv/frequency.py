"""Frequency responses of linear models, continuous and discrete, and how far two of them are apart."""

from __future__ import annotations

import math

import numpy as np

from hsv.base.errors import DesignError


def frequency_response(
    A: np.ndarray, B: np.ndarray, frequencies: np.ndarray, period: float | None = None
) -> np.ndarray:
    """Return the response (f, n, m) of all states to all inputs, complex.

    Args:
        A: (n, n) state matrix.
        B: (n, m) input matrix.
        frequencies: (f) rad/s.
        period: Sampling period (s) of a discrete-time model, ``None`` for a continuous one.

    Raises:
        DesignError: A frequency at or above the Nyquist frequency of a discrete-time model.
    """
    if period is not None and np.max(frequencies) >= math.pi / period:
        nyquist = math.pi / period
        raise DesignError(
            f"frequency {np.max(frequencies):.6g} rad/s: expected less than the Nyquist frequency {nyquist:.6g} rad/s"
        )
    s = 1j * np.asarray(frequencies, float)
    z = s if period is None else np.exp(s * period)
    return np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B.astype(complex))


def bode(response: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return magnitude (dB) and phase (deg, unwrapped along the first axis) of a complex response."""
    return 20.0 * np.log10(np.abs(response)), np.degrees(np.unwrap(np.angle(response), axis=0))


def bode_difference(response: np.ndarray, expected: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |difference| of magnitude (dB) and phase (deg, at most 180) of two complex responses."""
    ratio = response / expected
    return np.abs(20.0 * np.log10(np.abs(ratio))), np.abs(np.degrees(np.angle(ratio)))
