"""Tube-MPC law (paper eq. 36, eq. 48, eq. 54): u = F diag(tau) (x - x_r - x_n) + u_n + u_r within the limits.

The pitch rate in x is the filtered one; that of x_r + x_n is too where the design says so (eq. 48). Integral action on
the altitude and velocity errors is a named extension of the paper's law, off by default: it removes the offset that a
wrong mass or a lost elevator leaves, and adds two states that the invariant set does not know. Another one, off by
default as well, divides the elevator command by its estimated effectiveness (:mod:`hsv.control.effectiveness`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.compiled import bound, njit_in_flight
from hsv.control.controller import Controller, ControllerInput, ControllerResult
from hsv.control.coverage import HARDWARE_PARAMETERS, uncovered_hardware
from hsv.control.design import ControlDesign
from hsv.control.effectiveness import (
    WATCHED_PARAMETERS,
    Effectiveness,
    EffectivenessData,
    effectiveness_data,
    effectiveness_hold,
    effectiveness_in,
    effectiveness_shape,
    effectiveness_step,
)
from hsv.control.effectiveness_parameters import EFFECTIVENESS_PARAMETERS
from hsv.control.nominal_law import level
from hsv.control.notch_filter import (
    FLOWN_NOTCH_PARAMETERS,
    NotchData,
    NotchSection,
    discretise,
    filter_step,
    flown_sections,
)
from hsv.control.tube_factor import TAU, TAU_CHANGE_PARAMETERS, certified, compact, scheduled_changes
from hsv.errors import SignalError
from hsv.lanes import choose
from hsv.parameters import Parameter, check_all
from hsv.vehicle.dynamics import N_INPUTS, N_RIGID, N_STATES, PITCH_RATE
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.vehicle import COUPLING_PARAMETER


class TubeStatusCode(IntEnum):
    """State of the tube in a step; values of TubeStatus.status."""

    OK = 0
    NO_SET = 1
    OUTSIDE = 2
    INVALID_INPUT = 3
    UNCERTIFIED_VEHICLE = 4
    UNCERTIFIED_HARDWARE = 5


TUBE_PARAMETERS = (
    replace(TAU, read_only=False),
    *TAU_CHANGE_PARAMETERS,
    Parameter("integral.rate", 0.0, "k of the integral gain k F(:, [h V]); 0: no integral action", "1/s", 0.0, 1.0),
    *EFFECTIVENESS_PARAMETERS,
    COUPLING_PARAMETER,
    Parameter("vehicle.digest", "", "digest of the vehicle flown; empty: the default one"),
    *FLOWN_NOTCH_PARAMETERS,
    *HARDWARE_PARAMETERS,
)
"""Parameters of the tube law in addition to those of the design; declared hardware affects the status only."""

_N_INTEGRATED = 2
"""Altitude and velocity, the first two states."""

_ELEVATOR = 1
"""The elevator among the inputs."""


class TubeData(NamedTuple):
    """The law for compiled functions.

    ``gains`` F diag(tau) (c, 2, 9), each from its step in ``starts`` (c) on, the first from the beginning; input limits
    (2); whether the error is one from the plan ``x_r + x_n``, or from x_r alone; whether the plan's pitch rate is
    ``filtered``, by which ``notch``; rate (1/s) and ``period`` (s) of the integral action; the estimator of the
    elevator's effectiveness, where there is one.
    """

    gains: np.ndarray
    starts: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray
    planned: bool
    filtered: bool
    notch: NotchData
    integral_rate: float
    period: float
    effectiveness: EffectivenessData | None = None


def no_tube(vehicle: VehicleParameters) -> TubeData:
    """Return the data that replace a tube law if another controller flies: the input limits of ``vehicle``."""
    return TubeData(
        np.zeros((1, N_INPUTS, N_STATES)),
        np.zeros(1, np.int64),
        vehicle.input_minimum,
        vehicle.input_maximum,
        False,
        False,
        discretise((), 1.0),
        0.0,
        1.0,
    )


def memory_of(data: TubeData) -> np.ndarray:
    """Return the room of :func:`tube_step`: s_n (2 s) of the plan's filter, integral (2)."""
    return np.zeros(2 * len(data.notch.D) + _N_INTEGRATED)


def watch_of(data: TubeData) -> np.ndarray:
    """Return the room (r, 9) of the estimator in :func:`tube_step`, no rows where there is none."""
    return np.zeros(effectiveness_shape(data.effectiveness))


@njit_in_flight()
def active_gain(data: Any, step: int) -> int:
    """Return the index of the gain that holds in ``step``."""
    index = 0
    while index + 1 < len(data.starts) and data.starts[index + 1] <= step:
        index += 1
    return index


# Inlined where it is called: the arrays of a call cost as much as its arithmetic.
@njit_in_flight(inline="always")
def tube_step(
    data: Any,
    memory: Any,
    watch: Any,
    step: int,
    monitored: bool,
    x: Any,
    q_f: Any,
    x_r: Any,
    u_r: Any,
    x_n: Any,
    u_n: Any,
    s: Any,
    u_feedback: Any,
    u_total: Any,
    u: Any,
) -> int:
    """Write feedback, sum of all parts and limited input, (2) each (paper eq. 21, eq. 36); return the gain's index.

    The filter of the plan's pitch rate q'_n (eq. 48) starts from the state ``s`` of the one in the loop, which is exact
    where x = x_r + x_n; it is stepped where the law needs it or is ``monitored``, and where there is one in the loop.
    The integral stands still in every step in which an input is limited. Where the sum is not finite (a measurement
    that is not a number) the input is the reference's: an actuator gets a number whatever happens. Sum and limited
    input are what is commanded: where the elevator's effectiveness is estimated, what is to arrive divided by that.
    """
    active = active_gain(data, step)
    size = 2 * len(data.notch.D)
    if step == 0:
        for i in range(min(len(s), size)):
            memory[i] = s[i]
        for i in range(_N_INTEGRATED):
            memory[size + i] = 0.0
    pitch_rate_error = q_f - x_n[PITCH_RATE] - x_r[PITCH_RATE] if data.planned else q_f - x_r[PITCH_RATE]
    if (data.filtered or monitored) and 0 < size == len(s):
        planned_rate = filter_step(data.notch, memory, x_r[PITCH_RATE] + x_n[PITCH_RATE])
        if data.filtered:
            pitch_rate_error = q_f - planned_rate
    effectiveness = effectiveness_step(data.effectiveness, watch, step, x)
    limited = False
    for i in range(len(u)):
        feedback, integral = 0.0, 0.0
        # The error is computed once for each input: kept in an array, it would have to be read back from there.
        for j in range(len(x)):
            error = x[j] - x_n[j] - x_r[j] if data.planned else x[j] - x_r[j]
            feedback += data.gains[active, i, j] * (pitch_rate_error if j == PITCH_RATE else error)
        u_plan = u_n[i] if data.planned else 0.0
        if data.integral_rate > 0.0:
            for j in range(_N_INTEGRATED):
                integral += data.integral_rate * data.gains[active, i, j] * memory[size + j]
            u_plan += integral
        arriving = feedback + u_plan + u_r[i]
        u_total[i] = arriving / effectiveness if i == _ELEVATOR else arriving
        u_feedback[i] = feedback + integral
        wanted = choose(math.isfinite(u_total[i]), u_total[i], u_r[i])
        u[i] = min(max(wanted, data.minimum[i]), data.maximum[i])
        limited = limited | (u[i] != u_total[i])
    effectiveness_hold(data.effectiveness, watch, u)
    if data.integral_rate > 0.0:
        for j in range(_N_INTEGRATED):
            more = memory[size + j] + data.period * (x[j] - x_r[j] - x_n[j])
            memory[size + j] = choose(limited, memory[size + j], more)
    return active


def _plain(array: Any) -> np.ndarray:
    """Return ``array`` as float64 one after the other in memory: itself, in a flight."""
    return np.ascontiguousarray(array, float)


@dataclass(frozen=True)
class TubeResult(ControllerResult):
    """The input (2) to apply and how it came about; see the message TubeStatus for the fields.

    ``error`` (n) of the rigid states and, with the filter in the loop, of its states; ``tube_centre`` and
    ``tube_half_width`` (n) are empty, ``level`` is not a number and ``inside`` false where there is no set;
    ``component`` names the largest component of e - c for its half-width, outside the set; ``tau`` holds one factor, or
    that of each rigid state (5); ``effectiveness`` is None where it is not estimated.
    """

    error: np.ndarray
    tube_centre: np.ndarray
    tube_half_width: np.ndarray
    level: float
    inside: bool
    component: str
    u_feedback: np.ndarray
    u_nominal: np.ndarray
    tau: np.ndarray
    status: TubeStatusCode
    effectiveness: Effectiveness | None = None


class TubeLaw(Controller):
    """The controller's last stage."""

    PARAMETERS = (*TUBE_PARAMETERS, *(p for p in WATCHED_PARAMETERS if p is not COUPLING_PARAMETER))
    compiled_with_loop = True
    kernel: TubeData
    design: ControlDesign
    factors: list[tuple[int, np.ndarray]]
    """First step and tau (5) of each gain of the kernel."""

    def __init__(
        self,
        design: ControlDesign,
        coupling: str | None = None,
        notch: tuple[NotchSection, ...] | None = None,
        changes: Sequence[tuple[int, np.ndarray]] = (),
        integral_rate: float = 0.0,
        vehicle: str | None = None,
        hardware_covered: bool = True,
        effectiveness: EffectivenessData | None = None,
    ) -> None:
        """Fly ``design`` on a ``vehicle``, by its digest, with this set of inertial coupling.

        ``None``: those that it is certified for. ``hardware_covered``: whether it is for the hardware flown, too. The
        tube's set is one of the error with the design's notch filter: with another ``notch`` there is none. ``changes``
        of tau: first step and factors (5), in order.
        ``integral_rate``: k (1/s) of K_i = k F(:, [h V]). ``effectiveness``: the estimator of that of the elevator.
        """
        self.design = design
        self._certified = coupling in (None, design.coupling) and vehicle in (None, design.vehicle)
        self._hardware_covered = hardware_covered
        flown = notch or design.notch
        self._tube = design.tube if flown == design.notch else None
        self._notch = discretise(flown, design.period)
        self._integral_rate = integral_rate
        self._effectiveness = effectiveness
        self._tau, self._scheduled = design.tau, list(changes)
        self.reset()
        self._memory, self._watch = memory_of(self.kernel), watch_of(self.kernel)
        self._step, self._level = bound(tube_step), bound(level)
        # Compile now: a cold cache must not stall a flight.
        x, u = np.zeros(design.feedback_gain.shape[1]), np.zeros(len(design.input_minimum))
        given = ControllerInput(0, x, 0.0, x, u, x, u, np.zeros(2 * len(flown)))
        self.step(given)
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign | None = None) -> Self:
        """Build from the design's parameters and :data:`TUBE_PARAMETERS`; a wrong one is named in the error.

        ``design``: the one in ``values``, where it is known already.
        """
        v = check_all(TUBE_PARAMETERS, values)
        design = design or ControlDesign.from_parameters(values)
        changes = scheduled_changes(values, design.tau_minimum, design.period)
        vehicle = v["vehicle.digest"]
        covered = not uncovered_hardware(values, design)
        watch = effectiveness_data(values, design.period)
        sections, rate = flown_sections(values), v["integral.rate"]
        return cls(design, v["vehicle.coupling"], sections, changes, rate, vehicle, covered, watch)

    @property
    def gain(self) -> np.ndarray:
        """The gain F diag(tau) (2, 9) of the next step."""
        return np.asarray(self.kernel.gains[active_gain(self.kernel, self._next)])

    def reset(self) -> None:
        """Start a new run: with the factor set last, and with the scheduled changes to come."""
        self._next = 0
        self._arrange([(0, self._tau), *self._scheduled])

    def change_tau(self, values: Sequence[float]) -> int:
        """Fly with the factors ``values``, one or five, from the next step on; return that step.

        Raises:
            ParameterError: They are not certified.
        """
        self._tau = certified(values, self.design.tau_minimum)
        past = [entry for entry in self.factors if entry[0] < self._next]
        to_come = [entry for entry in self.factors if entry[0] > self._next]
        self._arrange([*past, (self._next, self._tau), *to_come])
        return self._next

    def _arrange(self, factors: list[tuple[int, np.ndarray]]) -> None:
        self.factors = factors
        self._compact = [compact(tau) for _, tau in factors]
        design = self.design
        self.kernel = TubeData(
            np.stack([design.adjusted_gain(tau) for _, tau in factors]),
            np.array([start for start, _ in factors], np.int64),
            design.input_minimum,
            design.input_maximum,
            True,
            design.filtered,
            self._notch,
            self._integral_rate,
            design.period,
            self._effectiveness,
        )

    def step(self, inputs: ControllerInput) -> TubeResult:
        """Return the input of this step; the first of a run is step 0.

        Raises:
            SignalError: The filter's states are neither those of the notch filter flown nor none.
        """
        k, estimate, q_f, *others = inputs
        # As the bound function takes them for granted, whoever made them.
        x, reference, _, deviation, _, filter_state = given = [_plain(array) for array in (estimate, *others)]
        memory, size, due = self._memory, len(filter_state), 2 * len(self._notch.D)
        if size not in (0, due):
            raise SignalError(
                "filter_state", f"filter_state: {size} numbers, expected {due} of the notch filter flown, or none"
            )
        in_loop = 0 < size == due
        planned = filter_state if k == 0 else memory[:size].copy()
        u_feedback, total, u = np.empty(2), np.empty(2), np.empty(2)
        active = self._step(self.kernel, memory, self._watch, k, True, x, q_f, *given[1:], u_feedback, total, u)
        self._next = k + 1
        error, tube = (x - reference - deviation)[:N_RIGID], None
        if in_loop:
            error, tube = np.concatenate((error, filter_state - planned)), self._tube
        level = float(self._level(tube.shape, error - tube.centre)) if tube else math.nan
        valid = math.isfinite(total[0]) and math.isfinite(total[1])
        inside = valid and level <= 1.0
        if not valid:
            status = TubeStatusCode.INVALID_INPUT
        elif tube is None:
            status = TubeStatusCode.NO_SET
        elif not inside:
            status = TubeStatusCode.OUTSIDE
        elif not self._certified:
            status = TubeStatusCode.UNCERTIFIED_VEHICLE
        else:
            status = TubeStatusCode.OK if self._hardware_covered else TubeStatusCode.UNCERTIFIED_HARDWARE
        return TubeResult(
            input=u,
            u_unsaturated=total,
            error=error,
            tube_centre=tube.centre if tube else np.empty(0),
            tube_half_width=tube.half_width if tube else np.empty(0),
            level=level,
            inside=inside,
            component=tube.farthest(error) if tube and not inside else "",
            u_feedback=u_feedback,
            u_nominal=inputs.nominal_input,
            tau=self._compact[active],
            status=status,
            effectiveness=effectiveness_in(self._watch) if self._effectiveness else None,
        )
