"""Tube-MPC law (paper eq. 36): u = tau F (x - x_r - x_n) + u_n + u_r, the pitch rate filtered, within the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np
from numba import njit

from hsv.control.design_file import ControlDesign
from hsv.control.notch_filter import (
    FLOWN_NOTCH_PARAMETERS,
    NotchData,
    NotchSection,
    discretise,
    filter_step,
    flown_sections,
)
from hsv.control.tube_set import TubeSet
from hsv.parameters import Parameter, check_all
from hsv.vehicle.parameters import COUPLING_SETS

PITCH_RATE = 4
N_RIGID = 5


class TubeStatusCode(IntEnum):
    """State of the tube in a step; values of TubeStatus.status."""

    OK = 0
    NO_SET = 1
    OUTSIDE = 2
    INVALID_INPUT = 3
    UNCERTIFIED_VEHICLE = 4


TUBE_PARAMETERS = (
    Parameter("vehicle.coupling", "paper_like", "set of inertial coupling of the vehicle flown", choices=COUPLING_SETS),
    *FLOWN_NOTCH_PARAMETERS,
)
"""Of the tube law, beside those of the design."""


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
    """Write the feedback part, the sum of the three parts and the limited input, (2) each.

    Where the sum is not finite (a measurement that is not a number) the input is the reference's: an actuator gets a
    number whatever happens.
    """
    for i in range(len(u)):
        feedback = 0.0
        for j in range(len(x)):
            measured = filtered_pitch_rate if j == PITCH_RATE else x[j]
            feedback += data.gain[i, j] * (measured - x_n[j] - x_r[j])
        u_feedback[i] = data.tau * feedback
        u_total[i] = u_feedback[i] + u_n[i] + u_r[i]
        wanted = u_total[i] if math.isfinite(u_total[i]) else u_r[i]
        u[i] = min(max(wanted, data.minimum[i]), data.maximum[i])


@dataclass(frozen=True)
class TubeResult:
    """The input (2) to apply and how it came about; see the message TubeStatus for the fields.

    ``error`` (n) of the rigid states and, with the filter in the loop, of its states; ``tube_centre`` and
    ``tube_half_width`` (n) are empty, ``level`` is not a number and ``inside`` false where there is no set;
    ``component`` names the largest component of e - c for its half-width, outside the set.
    """

    input: np.ndarray
    error: np.ndarray
    tube_centre: np.ndarray
    tube_half_width: np.ndarray
    level: float
    inside: bool
    component: str
    u_feedback: np.ndarray
    u_unsaturated: np.ndarray
    saturated: np.ndarray
    tau: float
    status: TubeStatusCode


class TubeMonitor:
    """Where the error is in the invariant set.

    The filter's error is s - s_n, s_n the state of the same filter fed with the pitch rate of reference + nominal. The
    first step takes s_n from the filter itself: exact at the start of a run, where x = x_r + x_n.
    """

    def __init__(self, tube: TubeSet | None, notch: NotchData) -> None:
        self._tube = tube
        self._notch = notch
        self._planned = np.zeros(2 * len(notch.D))
        self._started = False

    def reset(self) -> None:
        """Forget the past: the next step starts a new run."""
        self._started = False

    def step(
        self, error: np.ndarray, planned_rate: float, filter_state: np.ndarray
    ) -> tuple[np.ndarray, TubeSet | None]:
        """Return the error (n) of rigid states and filter, and the set that holds for it, if any.

        Args:
            error: (5) e = x - x_r - x_n.
            planned_rate: Pitch rate of reference + nominal (rad/s).
            filter_state: (2 s) of the notch filter before its update; empty: it is not in the loop.
        """
        if len(filter_state) != len(self._planned):
            return error, None
        if not self._started:
            self._planned[:] = filter_state
            self._started = True
        full = np.concatenate((error, filter_state - self._planned))
        filter_step(self._notch, self._planned, planned_rate)
        return full, self._tube


class TubeLaw:
    """The controller's last stage; only its monitor has a memory, so that a restart in flight changes no input."""

    def __init__(
        self,
        design: ControlDesign,
        tau: float = 1.0,
        coupling: str | None = None,
        notch: tuple[NotchSection, ...] | None = None,
    ) -> None:
        """Fly ``design`` on a vehicle with this set of inertial coupling, ``None``: the one it is certified for.

        The set is one of the error with the design's notch filter: with another ``notch`` there is none.
        """
        self.data = TubeData(design.feedback_gain, tau, design.input_minimum, design.input_maximum)
        self._certified = coupling in (None, design.coupling)
        flown = notch or design.notch
        self._monitor = TubeMonitor(design.tube if flown == design.notch else None, discretise(flown, design.period))
        # Compile now: a cold cache must not stall a flight.
        x, u = np.zeros(design.feedback_gain.shape[1]), np.zeros(len(design.input_minimum))
        self.step(x, 0.0, np.zeros(2 * len(flown)), x, u, x, u)
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> Self:
        """Build from the design's parameters and :data:`TUBE_PARAMETERS`; a wrong one is named in the error."""
        coupling = check_all(TUBE_PARAMETERS, values)["vehicle.coupling"]
        return cls(ControlDesign.from_parameters(values), coupling=coupling, notch=flown_sections(values))

    def reset(self) -> None:
        """Start a new run."""
        self._monitor.reset()

    def step(
        self,
        state: np.ndarray,
        filtered_pitch_rate: float,
        filter_state: np.ndarray,
        reference: np.ndarray,
        reference_input: np.ndarray,
        deviation: np.ndarray,
        nominal_input: np.ndarray,
    ) -> TubeResult:
        """Return the input of this step from x (9), q_f (rad/s), s (2 s), x_r (9), u_r (2), x_n (9) and u_n (2)."""
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
        planned_rate = float(reference[PITCH_RATE] + deviation[PITCH_RATE])
        error, tube = self._monitor.step((state - reference - deviation)[:N_RIGID], planned_rate, filter_state)
        level = tube.level(error) if tube else math.nan
        valid = math.isfinite(total[0]) and math.isfinite(total[1])
        inside = valid and level <= 1.0
        if not valid:
            status = TubeStatusCode.INVALID_INPUT
        elif tube is None:
            status = TubeStatusCode.NO_SET
        elif not inside:
            status = TubeStatusCode.OUTSIDE
        else:
            status = TubeStatusCode.OK if self._certified else TubeStatusCode.UNCERTIFIED_VEHICLE
        return TubeResult(
            input=u,
            error=error,
            tube_centre=tube.centre if tube else np.empty(0),
            tube_half_width=tube.half_width if tube else np.empty(0),
            level=level,
            inside=inside,
            component=tube.farthest(error) if tube and not inside else "",
            u_feedback=u_feedback,
            u_unsaturated=total,
            saturated=u != total,
            tau=self.data.tau,
            status=status,
        )
