"""Exact discretisation of linear systems whose input is held between samples (paper eq. 12)."""

from __future__ import annotations

import numpy as np


def zero_order_hold(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete (A, B) of dx/dt = A x + B u with u held over ``period`` (s) (paper eq. 12).

    Args:
        A: (n, n) continuous-time state matrix, SI per second.
        B: (n, m) continuous-time input matrix; the columns may be any inputs, disturbances too.
        period: Sampling period (s).
    """
    # Here, because tube_mpc imports this module without using it, and scipy.linalg takes longer than all else.
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n] = A
    block[:n, n:] = B
    transition = expm(block * period)
    return transition[:n, :n], transition[:n, n:]
