"""The error system of the tube: how e = x - x_r - x_n and the error of the notch filter evolve (paper eq. 22, eq. 23).

(18) less (20) gives, with the feedback F e closed,

    e(k+1) = (A_i + B_i F) e(k) + Delta(k)                                                                    (22), (23)

at every vertex i. The paper's error system leaves the notch filter out. Here its states belong to it: e_s = s - s_n,
where s_n is the state of the same filter fed with the pitch rate of reference + nominal from the same start. Then
e_s(k+1) = A_s e_s + B_s e_q exactly, and the feedback sees F_q (C_s e_s + D_s e_q) plus F_q (notch(q_n) - q_n), a
signal of the plan alone. The pitch rate in e is the true one.

Actuators that a design knows belong to it, too: e_a = a - a_n, where a_n are the same actuators driven by the plan
u_n + u_r from the same start. Then e_a(k+1) = A_a e_a + B_a (F e + lost elevator), and their position acts on e. The
nominal model takes the plan itself, so what the plan and a_n differ by, its lag, moves e as well. That is a signal of
the plan alone, and so is its effect in the closed loop, :func:`hsv.flight.responses.lag_response`:
e less that is the error in the tube.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hsv.control.notch_filter import with_notch
from hsv.core import Struct
from hsv.flight.responses import along_filter
from hsv.model.actuators import ActuatorSet
from hsv.model.lpv.actuated import actuator_names, respond, sampled_actuators
from hsv.model.signals import N_RIGID, PITCH_RATE, STATE_NAMES


@dataclass(frozen=True)
class ErrorSystem:
    """e(k+1) = A_i e(k) + G_i d(k), the feedback closed; n states, d disturbance channels, r vertices.

    ``A`` (r, n, n) closed loop; ``G`` (r, n, d) columns of the channels; ``F`` (2, n) the feedback on e, and ``F_d``
    (2, d) on d; ``names`` (n); ``B`` (r, n, 2) columns of commands. SI per period.
    """

    A: np.ndarray
    B: np.ndarray
    G: np.ndarray
    F: np.ndarray
    F_d: np.ndarray
    names: tuple[str, ...]
    unseen: int = 0
    """Number of states at the end that a controller does not see: those of actuators."""

    @property
    def seen(self) -> int:
        """Number of states at the beginning that a controller sees."""
        return len(self.names) - self.unseen


def error_system(
    A: np.ndarray,
    B: np.ndarray,
    F: np.ndarray,
    notch: Struct,
    channels: np.ndarray,
    actuators: Sequence[ActuatorSet] = (),
    period: float = 0.0,
) -> ErrorSystem:
    """Return the error system of rigid states, notch filter and actuators (paper eq. 23, with the latter two in it).

    The flexible states of the decoupled model follow the rigid ones and are not fed back, so they stay outside.

    Args:
        A: (r, 9, 9) or (r, 5, 5) vertices, discrete time.
        B: (r, 9, 2) or (r, 5, 2) vertices.
        F: (2, 9) or (2, 5) feedback gain.
        notch: The discrete filter.
        channels: (5, 3) effect of the acceleration channels over a period.
        actuators: Actuators of the design; F does not act on their states, which come last.
        period: s, that of the actuators.
    """
    r = len(A)
    A_x, B_x, F_x = A[:, :N_RIGID, :N_RIGID], B[:, :N_RIGID], F[:, :N_RIGID]
    if actuators:
        A_x, B_x, F_x = _with_actuators(A_x, B_x, F_x, sampled_actuators(actuators, period))
    whole, inputs, gain = with_notch(A_x, B_x, F_x, notch)
    n, a = whole.shape[1], A_x.shape[1] - N_RIGID
    columns = np.zeros((r, n, 7))
    columns[:, :N_RIGID, :3] = channels
    columns[:, : N_RIGID + a, 3] = B_x[:, :, 1]
    columns[:, : N_RIGID + a, 4] = B_x @ F_x[:, PITCH_RATE]
    columns[:, 0, 5] = columns[:, 3, 6] = 1.0
    names = STATE_NAMES[:N_RIGID] + tuple(f"filter_{i + 1}" for i in range(n - N_RIGID - a))
    if actuators:
        # The filter comes before the actuators, so that the controller sees the first states of the set.
        order = np.r_[:N_RIGID, N_RIGID + a : n, N_RIGID : N_RIGID + a]
        whole, inputs, columns = whole[:, order][:, :, order], inputs[:, order], columns[:, order]
        gain, names = gain[:, order], names + actuator_names(actuators)
    feedthrough = np.zeros((2, columns.shape[2]))
    feedthrough[:, 4] = F_x[:, PITCH_RATE]
    return ErrorSystem(whole + inputs @ gain, inputs, columns, gain, feedthrough, names, a)


def _with_actuators(
    A: np.ndarray, B: np.ndarray, F: np.ndarray, actuators: Struct
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices A (r, n + a, n + a) and B (r, n + a, 2), and F (2, n + a), the actuators' states last."""
    (r, n, _), a = A.shape, len(actuators.A)
    whole, inputs = np.zeros((r, n + a, n + a)), np.empty((r, n + a, B.shape[2]))
    whole[:, :n, :n], whole[:, :n, n:], whole[:, n:, n:] = A, B @ actuators.C, actuators.A
    inputs[:, :n], inputs[:, n:] = B @ actuators.D, actuators.B
    return whole, inputs, np.concatenate((F, np.zeros((len(F), a))), axis=1)


def union(first: ErrorSystem, *others: ErrorSystem) -> ErrorSystem:
    """Return the system that may switch between the vertices of all systems, with the feedback F of the ``first``."""
    systems = (first, *others)
    A, B, G = (np.concatenate([getattr(s, name) for s in systems]) for name in ("A", "B", "G"))
    return replace(first, A=A, B=B, G=G)


def tube_errors(
    state: np.ndarray,
    deviation: np.ndarray,
    reference: np.ndarray,
    notch: Struct,
    actuators: Struct | None = None,
    beyond_plan: np.ndarray | None = None,
) -> np.ndarray:
    """Return e (k, n) of a flight: rigid states, then the filter's, then those of actuators that the design knows.

    Args:
        state: (k, 9) x at every step, from the first.
        deviation: (k, 9) x_n.
        reference: (k, 9) x_r.
        notch: The discrete filter; it is linear, so its error is the filter's answer to the error of the pitch rate.
        actuators: Likewise, without their limits.
        beyond_plan: (k, 2) what they are commanded beyond the plan, u - u_n - u_r, a loss of it included.
    """
    rigid = (state - deviation - reference)[:, :N_RIGID]
    errors = [rigid, along_filter(notch, rigid[:, PITCH_RATE])[1]]
    if actuators is not None and beyond_plan is not None:
        errors.append(respond(actuators, beyond_plan)[0])
    return np.hstack(errors)
