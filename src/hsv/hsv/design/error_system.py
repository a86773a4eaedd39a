"""The error system of the tube: how e = x - x_r - x_n and the error of the notch filter evolve (paper eq. 22, eq. 23).

Subtracting (20) from (18) gives, with the feedback F e closed,

    e(k+1) = (A_i + B_i F) e(k) + Delta(k)                                                                    (22), (23)

at every vertex i. The paper's error system leaves the notch filter out; here it includes the error of the filter state,
e_s = s - s_n. The state s_n is that of the same filter with the same start, driven by the pitch rate q_n of x_r + x_n.
The filter is linear, so e_s(k+1) = A_s e_s + B_s e_q exactly, with e_q the error of the true pitch rate. With the gain
F_q, the pitch-rate feedback is F_q (C_s e_s + D_s e_q) plus F_q (notch(q_n) - q_n), which depends on the plan only.

The error system also includes the actuators of the design, with e_a = a - a_n. The state a_n is that of the same
actuators driven by the plan u_n + u_r. Then e_a(k+1) = A_a e_a + B_a (F e + lost elevator), and the positions act on e.
The input of the nominal model is the plan itself, without actuators. The lag, the difference between the response to
the plan and the plan, therefore drives e as well. It depends on the plan only, and its effect in the closed loop is
computed separately, by :meth:`hsv.flight.disturbance.ChannelModel.lag`. The tube error is e minus this effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hsv.control.notch_filter import with_notch
from hsv.core import Struct
from hsv.model.actuators import ActuatorSet
from hsv.model.lpv.actuated import actuator_names, behind_sampled, sampled_actuators
from hsv.model.signals import N_RIGID, PITCH_RATE, STATE_NAMES


@dataclass(frozen=True)
class ErrorSystem:
    """The error system e(k+1) = A_i e(k) + G_i d(k) with closed feedback: n states, d disturbance channels, r vertices.

    ``A`` (r, n, n): closed loop; ``B`` (r, n, 2): columns of the commands; ``G`` (r, n, d): columns of the channels;
    ``F`` (2, n): feedback on e; ``F_d`` (2, d): feedback on d; ``names`` (n): names of the states. SI per period.
    """

    A: np.ndarray
    B: np.ndarray
    G: np.ndarray
    F: np.ndarray
    F_d: np.ndarray
    names: tuple[str, ...]
    unseen: int = 0
    """Number of trailing states, those that the controller does not know: states of actuators, and delayed samples."""

    @property
    def seen(self) -> int:
        """Number of leading states, those that the controller knows: rigid states, then states of the notch filter."""
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
    """Return the error system of rigid states, notch filter and actuators (paper eq. 23, extended by the latter two).

    It omits the flexible states: in the decoupled model they do not act on the rigid ones, and they are not fed back.

    Args:
        A: (r, 9, 9) or (r, 5, 5) state matrices of the vertices, discrete time.
        B: (r, 9, 2) or (r, 5, 2) input matrices of the vertices.
        F: (2, 9) or (2, 5) feedback gain.
        notch: The notch filter in discrete time.
        channels: (5, 3) from :func:`hsv.model.lpv.linearisation.acceleration_channels`.
        actuators: Actuators of the design; their states come last, and F does not act on them.
        period: Sampling period (s); used for actuators only.
    """
    r = len(A)
    A_x, B_x, F_x = A[:, :N_RIGID, :N_RIGID], B[:, :N_RIGID], F[:, :N_RIGID]
    if actuators:
        A_x, B_x = behind_sampled(A_x, B_x, sampled_actuators(actuators, period))
        F_x = np.pad(F_x, ((0, 0), (0, A_x.shape[1] - N_RIGID)))
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


def union(first: ErrorSystem, *others: ErrorSystem) -> ErrorSystem:
    """Return the error system that may switch between the vertices of all systems, with F and F_d of the ``first``."""
    systems = (first, *others)
    A, B, G = (np.concatenate([getattr(s, name) for s in systems]) for name in ("A", "B", "G"))
    return replace(first, A=A, B=B, G=G)
