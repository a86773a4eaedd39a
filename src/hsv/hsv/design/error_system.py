"""The error system of the tube: how e = x - x_r - x_n and the error of the notch filter evolve (paper eq. 22).

The paper's error system leaves the notch filter out. Here its states belong to it: e_s = s - s_n, where s_n is the
state of the same filter fed with the pitch rate of reference + nominal from the same start. Then
e_s(k+1) = A_s e_s + B_s e_q exactly, and the feedback sees F_q (C_s e_s + D_s e_q) plus F_q (notch(q_n) - q_n), a
signal of the plan alone. The pitch rate in e is the true one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit

from hsv.control.notch_filter import NotchData, filter_step, rest, with_notch
from hsv.vehicle.dynamics import N_RIGID, PITCH_RATE, STATE_NAMES


@dataclass(frozen=True)
class ErrorSystem:
    """e(k+1) = A_i e(k) + G_i d(k), the feedback closed; n states, d disturbance channels, r vertices.

    ``A`` (r, n, n) closed loop; ``G`` (r, n, d) columns of the channels; ``F`` (2, n) the feedback on e, and ``F_d``
    (2, d) on d; ``names`` (n). SI per period.
    """

    A: np.ndarray
    G: np.ndarray
    F: np.ndarray
    F_d: np.ndarray
    names: tuple[str, ...]


def error_system(A: np.ndarray, B: np.ndarray, F: np.ndarray, notch: NotchData, channels: np.ndarray) -> ErrorSystem:
    """Return the error system of the rigid states and the notch filter (paper eq. 23, with the filter in it).

    The flexible states of the decoupled model follow the rigid ones and are not fed back, so they stay outside.

    Args:
        A: (r, 9, 9) or (r, 5, 5) vertices, discrete time.
        B: (r, 9, 2) or (r, 5, 2) vertices.
        F: (2, 9) or (2, 5) feedback gain.
        notch: The discrete filter.
        channels: (5, 3) effect of the acceleration channels over a period.
    """
    r = len(A)
    A_x, B_x, F_x = A[:, :N_RIGID, :N_RIGID], B[:, :N_RIGID], F[:, :N_RIGID]
    whole, inputs, gain = with_notch(A_x, B_x, F_x, notch)
    n = whole.shape[1]
    columns = np.zeros((r, n, 7))
    columns[:, :N_RIGID, :3] = channels
    columns[:, :N_RIGID, 3] = B_x[:, :, 1]
    columns[:, :N_RIGID, 4] = B_x @ F_x[:, PITCH_RATE]
    columns[:, 0, 5] = columns[:, 3, 6] = 1.0
    names = STATE_NAMES[:N_RIGID] + tuple(f"filter_{i + 1}" for i in range(n - N_RIGID))
    feedthrough = np.zeros((2, columns.shape[2]))
    feedthrough[:, 4] = F_x[:, PITCH_RATE]
    return ErrorSystem(whole + inputs @ gain, columns, gain, feedthrough, names)


def union(first: ErrorSystem, *others: ErrorSystem) -> ErrorSystem:
    """Return the system that may switch between the vertices of all; its feedback F is that of the ``first``."""
    systems = (first, *others)
    return replace(first, A=np.concatenate([s.A for s in systems]), G=np.concatenate([s.G for s in systems]))


def paper_system(A: np.ndarray, B: np.ndarray, F: np.ndarray) -> ErrorSystem:
    """Return the error system as the paper has it (eq. 22): all states, no filter, a disturbance on every state."""
    r, n, _ = A.shape
    identity = np.broadcast_to(np.eye(n), (r, n, n))
    return ErrorSystem(A + B @ F, identity, F, np.zeros((len(F), n)), STATE_NAMES)


def tube_errors(state: np.ndarray, deviation: np.ndarray, reference: np.ndarray, notch: NotchData) -> np.ndarray:
    """Return e (k, n) of a flight: rigid states, then the filter's.

    Args:
        state: (k, 9) x at every step, from the first.
        deviation: (k, 9) x_n.
        reference: (k, 9) x_r.
        notch: The discrete filter; it is linear, so its error is the filter's answer to the error of the pitch rate.
    """
    rigid = (state - deviation - reference)[:, :N_RIGID]
    errors = np.zeros((len(state), N_RIGID + 2 * len(notch.D)))
    errors[:, :N_RIGID] = rigid
    filter_state = np.zeros(2 * len(notch.D))
    _filter_errors(notch, np.ascontiguousarray(rigid[:, PITCH_RATE]), filter_state, errors[:, N_RIGID:])
    return errors


@njit(cache=True, nogil=True)
def _filter_errors(notch: Any, rate: np.ndarray, filter_state: np.ndarray, errors: np.ndarray) -> None:
    rest(notch, rate[0], filter_state)
    for k in range(len(rate)):
        errors[k] = filter_state
        filter_step(notch, filter_state, rate[k])
