"""Tube-MPC law (paper eq. 36, 48, 54): u = F diag(tau) (x - x_r - x_n) + u_n + u_r within the limits.

The pitch rate in x is the filtered one; that of x_r + x_n is too where the design says so (eq. 48).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np
from numba import njit

from hsv.control.adjustable import TAU, TAU_CHANGE_PARAMETERS, certified, compact, scheduled_changes
from hsv.control.design_file import ControlDesign
from hsv.control.notch_filter import (
    FLOWN_NOTCH_PARAMETERS,
    NotchData,
    NotchSection,
    discretise,
    flown_sections,
)
from hsv.control.planned_filter import PlannedFilter
from hsv.parameters import Parameter, check_all
from hsv.vehicle.dynamics import N_RIGID, PITCH_RATE
from hsv.vehicle.parameters import COUPLING_SETS


class TubeStatusCode(IntEnum):
    """State of the tube in a step; values of TubeStatus.status."""

    OK = 0
    NO_SET = 1
    OUTSIDE = 2
    INVALID_INPUT = 3
    UNCERTIFIED_VEHICLE = 4


TUBE_PARAMETERS = (
    replace(TAU, read_only=False),
    *TAU_CHANGE_PARAMETERS,
    Parameter("vehicle.coupling", "paper_like", "set of inertial coupling of the vehicle flown", choices=COUPLING_SETS),
    *FLOWN_NOTCH_PARAMETERS,
)
"""Of the tube law, beside those of the design."""


class TubeData(NamedTuple):
    """The law for compiled functions.

    ``gains`` F diag(tau) (c, 2, 9), each from its step in ``starts`` (c) on, the first from the beginning; input limits
    (2); whether the plan's pitch rate is ``filtered``, by which ``notch``.
    """

    gains: np.ndarray
    starts: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray
    filtered: bool
    notch: NotchData


@njit(cache=True)
def active_gain(data: Any, step: int) -> int:
    """Return the index of the gain that holds in ``step``."""
    index = 0
    while index + 1 < len(data.starts) and data.starts[index + 1] <= step:
        index += 1
    return index


@njit(cache=True)
def tube_input(
    data: Any,
    gain: np.ndarray,
    x: np.ndarray,
    pitch_rate_error: float,
    x_r: np.ndarray,
    x_n: np.ndarray,
    u_n: np.ndarray,
    u_r: np.ndarray,
    u_feedback: np.ndarray,
    u_total: np.ndarray,
    u: np.ndarray,
) -> None:
    """Write the feedback part, by ``gain`` (2, 9), the sum of the three parts and the limited input, (2) each.

    ``pitch_rate_error``: filtered pitch rate less that of the plan. Where the sum is not finite (a measurement that is
    not a number) the input is the reference's: an actuator gets a number whatever happens.
    """
    for i in range(len(u)):
        feedback = 0.0
        for j in range(len(x)):
            error = pitch_rate_error if j == PITCH_RATE else x[j] - x_n[j] - x_r[j]
            feedback += gain[i, j] * error
        u_feedback[i] = feedback
        u_total[i] = u_feedback[i] + u_n[i] + u_r[i]
        wanted = u_total[i] if math.isfinite(u_total[i]) else u_r[i]
        u[i] = min(max(wanted, data.minimum[i]), data.maximum[i])


@dataclass(frozen=True)
class TubeResult:
    """The input (2) to apply and how it came about; see the message TubeStatus for the fields.

    ``error`` (n) of the rigid states and, with the filter in the loop, of its states; ``tube_centre`` and
    ``tube_half_width`` (n) are empty, ``level`` is not a number and ``inside`` false where there is no set;
    ``component`` names the largest component of e - c for its half-width, outside the set; ``tau`` holds one factor, or
    that of each rigid state (5).
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
    tau: np.ndarray
    status: TubeStatusCode


class TubeLaw:
    """The controller's last stage. Its feedback has no memory but for the filtered plan of eq. 48."""

    def __init__(
        self,
        design: ControlDesign,
        coupling: str | None = None,
        notch: tuple[NotchSection, ...] | None = None,
        changes: Sequence[tuple[int, np.ndarray]] = (),
    ) -> None:
        """Fly ``design`` on a vehicle with this set of inertial coupling, ``None``: the one it is certified for.

        The set is one of the error with the design's notch filter: with another ``notch`` there is none. ``changes`` of
        tau: first step and factors (5), in order.
        """
        self._design = design
        self._certified = coupling in (None, design.coupling)
        flown = notch or design.notch
        self._tube = design.tube if flown == design.notch else None
        self._notch = discretise(flown, design.period)
        self._planned = PlannedFilter(self._notch)
        self._tau, self._scheduled = design.tau, list(changes)
        self.reset()
        # Compile now: a cold cache must not stall a flight.
        x, u = np.zeros(design.feedback_gain.shape[1]), np.zeros(len(design.input_minimum))
        self.step(x, 0.0, np.zeros(2 * len(flown)), x, u, x, u)
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign | None = None) -> Self:
        """Build from the design's parameters and :data:`TUBE_PARAMETERS`; a wrong one is named in the error.

        ``design``: the one in ``values``, where it is known already.
        """
        coupling = check_all(TUBE_PARAMETERS, values)["vehicle.coupling"]
        design = design or ControlDesign.from_parameters(values)
        changes = scheduled_changes(values, design.tau_minimum, design.period)
        return cls(design, coupling, flown_sections(values), changes)

    @property
    def gain(self) -> np.ndarray:
        """The gain F diag(tau) (2, 9) of the next step."""
        return np.asarray(self.data.gains[active_gain(self.data, self._step)])

    def reset(self) -> None:
        """Start a new run: with the factor set last, and with the scheduled changes to come."""
        self._step = 0
        self._planned.reset()
        self._arrange([(0, self._tau), *self._scheduled])

    def change_tau(self, values: Sequence[float]) -> int:
        """Fly with the factors ``values``, one or five, from the next step on; return that step.

        Raises:
            ParameterError: They are not certified.
        """
        self._tau = certified(values, self._design.tau_minimum)
        past = [entry for entry in self._entries if entry[0] < self._step]
        to_come = [entry for entry in self._entries if entry[0] > self._step]
        self._arrange([*past, (self._step, self._tau), *to_come])
        return self._step

    def _arrange(self, entries: list[tuple[int, np.ndarray]]) -> None:
        self._entries = entries
        design = self._design
        self.data = TubeData(
            np.stack([design.adjusted_gain(tau) for _, tau in entries]),
            np.array([start for start, _ in entries], np.int64),
            design.input_minimum,
            design.input_maximum,
            design.filtered,
            self._notch,
        )

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
        planned = self._planned.step(float(reference[PITCH_RATE] + deviation[PITCH_RATE]), filter_state)
        if planned and self.data.filtered:
            pitch_rate_error = filtered_pitch_rate - planned.filtered_pitch_rate
        else:
            pitch_rate_error = filtered_pitch_rate - float(deviation[PITCH_RATE]) - float(reference[PITCH_RATE])
        active = active_gain(self.data, self._step)
        self._step += 1
        u_feedback, total, u = np.empty(2), np.empty(2), np.empty(2)
        tube_input(
            self.data,
            self.data.gains[active],
            state,
            pitch_rate_error,
            reference,
            deviation,
            nominal_input,
            reference_input,
            u_feedback,
            total,
            u,
        )
        error, tube = (state - reference - deviation)[:N_RIGID], None
        if planned:
            error, tube = np.concatenate((error, filter_state - planned.filter_state)), self._tube
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
            tau=compact(self._entries[active][1]),
            status=status,
        )
