"""Tube-MPC law (paper eq. 36): u = tau F (x - x_r - x_n) + u_n + u_r, with the filtered pitch rate, within the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np
from numba import njit

from hsv.control.design_file import ControlDesign

PITCH_RATE = 4
N_RIGID = 5


class TubeStatusCode(IntEnum):
    """State of the tube in a step; values of TubeStatus.status."""

    OK = 0
    NO_SET = 1
    OUTSIDE = 2
    INVALID_INPUT = 3


class TubeData(NamedTuple):
    """Feedback gain F (2, 9), adjustable factor and input limits (2), for compiled functions."""

    gain: np.ndarray
    tau: float
    minimum: np.ndarray
    maximum: np.ndarray


@njit(cache=True)
def tube_input(
    data: Any,
    x: np.ndarray,
    filtered_pitch_rate: float,
    x_r: np.ndarray,
    x_n: np.ndarray,
    u_n: np.ndarray,
    u_r: np.ndarray,
    u_feedback: np.ndarray,
    u_total: np.ndarray,
    u: np.ndarray,
) -> None:
    """Write the feedback part, the sum of the three parts and the limited input, (2) each."""
    for i in range(len(u)):
        feedback = 0.0
        for j in range(len(x)):
            measured = filtered_pitch_rate if j == PITCH_RATE else x[j]
            feedback += data.gain[i, j] * (measured - x_n[j] - x_r[j])
        u_feedback[i] = data.tau * feedback
        u_total[i] = u_feedback[i] + u_n[i] + u_r[i]
        u[i] = min(max(u_total[i], data.minimum[i]), data.maximum[i])


@dataclass(frozen=True)
class TubeResult:
    """The input (2) to apply and how it came about; see the message TubeStatus for the fields."""

    input: np.ndarray
    error: np.ndarray
    u_feedback: np.ndarray
    u_unsaturated: np.ndarray
    saturated: np.ndarray
    tau: float
    status: TubeStatusCode


class TubeLaw:
    """The controller's last stage; it has no memory, so that a restart in flight loses nothing."""

    def __init__(self, design: ControlDesign, tau: float = 1.0) -> None:
        self.data = TubeData(design.feedback_gain, tau, design.input_minimum, design.input_maximum)

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> Self:
        """Build from the design's parameters; a wrong one raises DesignError with its name."""
        return cls(ControlDesign.from_parameters(values))

    def reset(self) -> None:
        """Nothing to forget."""

    def step(
        self,
        state: np.ndarray,
        filtered_pitch_rate: float,
        reference: np.ndarray,
        reference_input: np.ndarray,
        deviation: np.ndarray,
        nominal_input: np.ndarray,
    ) -> TubeResult:
        """Return the input of this step from x (9), q_f (rad/s), x_r (9), u_r (2), x_n (9) and u_n (2)."""
        u_feedback, total, u = np.empty(2), np.empty(2), np.empty(2)
        tube_input(
            self.data,
            state,
            filtered_pitch_rate,
            reference,
            deviation,
            nominal_input,
            reference_input,
            u_feedback,
            total,
            u,
        )
        error = (state - reference - deviation)[:N_RIGID]
        finite = math.isfinite(total[0]) and math.isfinite(total[1])
        return TubeResult(
            input=u,
            error=error,
            u_feedback=u_feedback,
            u_unsaturated=total,
            saturated=u != total,
            tau=self.data.tau,
            status=TubeStatusCode.NO_SET if finite else TubeStatusCode.INVALID_INPUT,
        )
