"""Tube-MPC law (paper eq. 36, eq. 48, eq. 54): u = F diag(tau) (x - x_r - x_n) + u_n + u_r within the limits.

The pitch rate in x is the filtered one; that of x_r + x_n is filtered too if ``design.filtered`` (eq. 48). Integral
action on the altitude and velocity errors is a named extension of the paper's law, off by default: it removes the
offset that a wrong mass or a lost elevator leaves, and adds two states that the invariant set does not know. Another
one, off by default as well, divides the elevator command by its estimated effectiveness
(:mod:`hsv.control.effectiveness`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Self

import numpy as np

from hsv.base.errors import SignalError
from hsv.base.parameters import Parameter, validate
from hsv.control.controller import Controller, ControllerInput, ControllerResult
from hsv.control.coverage import HARDWARE_PARAMETERS, uncovered_hardware
from hsv.control.design import TAU, TAU_CHANGE_PARAMETERS, ControlDesign, certified, compact, scheduled_changes
from hsv.control.effectiveness import (
    EFFECTIVENESS_PARAMETERS,
    WATCHED_PARAMETERS,
    Effectiveness,
    effectiveness_data,
    effectiveness_in,
)
from hsv.control.nominal_law import level
from hsv.control.notch_filter import (
    FLOWN_NOTCH_PARAMETERS,
    NotchSection,
    discretise,
    flown_sections,
)
from hsv.core import Struct, doubles, dtype, lib, records, vector
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES
from hsv.model.vehicle import COUPLING_PARAMETER


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


def tube_data(
    gains: np.ndarray, minimum: np.ndarray, maximum: np.ndarray, period: float = 1.0, **others: Any
) -> Struct:
    """Return the law for the core, ``hsv_tube``, by default a feedback on x - x_r without memory.

    Args:
        gains: F diag(tau) (c, 2, 9).
        minimum: Limits of the input (2).
        maximum: (2)
        period: T (s).
        others: ``starts`` (c), the first step of each gain; ``planned``, whether the error is taken from the plan
            x_r + x_n; ``filtered``, whether the pitch rate of the plan passes the ``notch`` filter; ``integral_rate``
            (1/s); ``effectiveness``, the estimator.
    """
    values: dict[str, Any] = {
        "starts": np.zeros(1, np.int64),
        "planned": False,
        "filtered": False,
        "notch": discretise((), period),
        "integral_rate": 0.0,
        "effectiveness": None,
    }
    return Struct("hsv_tube", gains=gains, minimum=minimum, maximum=maximum, period=period, **values | others)


def no_tube(vehicle: VehicleParameters) -> Struct:
    """Return the data that replace a tube law if another controller flies: the input limits of ``vehicle``."""
    return tube_data(np.zeros((1, N_INPUTS, N_STATES)), vehicle.input_minimum, vehicle.input_maximum)


def tube_memory() -> np.ndarray:
    """Return the memory of the law, a record that step 0 initialises."""
    return np.zeros((), dtype("hsv_tube_memory"))


def tube_step(
    data: Struct, memory: np.ndarray, inputs: ControllerInput, *, monitored: bool = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return feedback, unsaturated and limited input (2 each) of a step, and the index of its gain (eq. 21, eq. 36).

    Args:
        data: The law.
        memory: See :func:`tube_memory`, updated.
        inputs: Those of the controller.
        monitored: Whether to step the filter of the plan even if the law does not need it.
    """
    k, feedback_state, q_f, *others = inputs
    sizes = (N_STATES, N_INPUTS, N_STATES, N_INPUTS, len(inputs.filter_state))
    given = [doubles(vector(each), size) for each, size in zip(others, sizes, strict=True)]
    feedback, unsaturated, limited = (np.empty(N_INPUTS) for _ in range(3))
    active = lib.hsv_tube_step(
        data.pointer,
        records("hsv_tube_memory", memory),
        k,
        monitored,
        len(inputs.filter_state),
        doubles(vector(feedback_state), N_STATES),
        q_f,
        *given,
        *map(doubles, (feedback, unsaturated, limited)),
    )
    return feedback, unsaturated, limited, int(active)


def active_gain(data: Struct, step: int) -> int:
    """Return the index of the active gain in ``step``."""
    return max(int(np.searchsorted(data.starts, step, side="right")) - 1, 0)


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
    """The Tube-MPC law with its monitor: where the error is in the invariant set."""

    PARAMETERS = (*TUBE_PARAMETERS, *(p for p in WATCHED_PARAMETERS if p is not COUPLING_PARAMETER))
    in_core = True
    kernel: Struct
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
        effectiveness: Struct | None = None,
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
        self._memory = tube_memory()

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign | None = None) -> Self:
        """Build from the design's parameters and :data:`TUBE_PARAMETERS`; a wrong one is named in the error.

        ``design``: the one in ``values``, where it is known already.
        """
        v = validate(TUBE_PARAMETERS, values)
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
        """Reset for a new run: the current factor stays, and the scheduled changes will be applied."""
        self._next = 0
        self._arrange([(0, self._tau), *self._scheduled])

    def change_tau(self, values: Sequence[float]) -> int:
        """Use the factors ``values``, one or five, from the next step on; return that step.

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
        self.kernel = tube_data(
            np.stack([design.adjusted_gain(tau) for _, tau in factors]),
            design.input_minimum,
            design.input_maximum,
            design.period,
            starts=np.array([start for start, _ in factors], np.int64),
            planned=True,
            filtered=design.filtered,
            notch=self._notch,
            integral_rate=self._integral_rate,
            effectiveness=self._effectiveness,
        )

    def step(self, inputs: ControllerInput) -> TubeResult:
        """Return the input of this step; the first of a run is step 0.

        Raises:
            SignalError: The filter's states are neither those of the notch filter flown nor none.
        """
        k, filter_state = inputs.step, inputs.filter_state
        size, due = len(filter_state), 2 * len(self._notch.D)
        if size not in (0, due):
            raise SignalError(
                "filter_state", f"filter_state: {size} numbers, expected {due} of the notch filter flown, or none"
            )
        in_loop = size == due
        planned = filter_state if k == 0 else self._memory["planned"][:size].copy()
        feedback, total, u, active = tube_step(self.kernel, self._memory, inputs)
        self._next = k + 1
        error, tube = (inputs.estimate - inputs.reference - inputs.deviation)[:N_RIGID], None
        if in_loop:
            error, tube = np.concatenate((error, filter_state - planned)), self._tube
        tube_level = level(tube.shape, error - tube.centre) if tube else math.nan
        valid = math.isfinite(total[0]) and math.isfinite(total[1])
        inside = valid and tube_level <= 1.0
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
            level=tube_level,
            inside=inside,
            component=tube.farthest(error) if tube and not inside else "",
            u_feedback=feedback,
            u_nominal=inputs.nominal_input,
            tau=self._compact[active],
            status=status,
            effectiveness=effectiveness_in(self._memory) if self._effectiveness else None,
        )
