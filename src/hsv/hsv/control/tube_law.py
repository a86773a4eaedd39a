"""Tube-MPC law (paper eq. 36, eq. 48, eq. 54): u = F diag(tau) (x - x_r - x_n) + u_n + u_r within the limits.

The pitch rate in x is the filtered one; that of x_r + x_n is filtered, too, if ``design.filtered`` (eq. 48). Two
extensions of the paper's law are off by default. Integral action on the errors of altitude and velocity removes the
offset that a wrong mass or a loss of elevator effectiveness leaves; it adds two states that the invariant set does not
include. The other extension divides the elevator command by its estimated effectiveness
(:mod:`hsv.control.effectiveness`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from typing import Any, Self

import numpy as np

from hsv.base.errors import SignalError
from hsv.base.parameters import Parameter, validate
from hsv.control.controller import Controller, ControllerInput, ControllerResult
from hsv.control.design import TAU, TAU_CHANGE_PARAMETERS, ControlDesign, certified, compact, scheduled_changes, shaped
from hsv.control.effectiveness import (
    EFFECTIVENESS_PARAMETERS,
    WATCHED_PARAMETERS,
    Effectiveness,
    effectiveness_data,
    effectiveness_in,
)
from hsv.control.hardware import HARDWARE_PARAMETERS, uncovered_hardware
from hsv.control.nominal_law import ellipsoid_level
from hsv.control.notch_filter import FLOWN_NOTCH_PARAMETERS, NotchSection, discretise, flown_sections
from hsv.core import Struct, doubles, dtype, lib, records
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES
from hsv.model.vehicle import COUPLING_PARAMETER


class TubeStatusCode(IntEnum):
    """State of the tube in a step; values of ``status`` in the message TubeStatus, which describes them."""

    OK = 0
    NO_SET = 1
    OUTSIDE = 2
    INVALID_INPUT = 3
    UNCERTIFIED_VEHICLE = 4
    UNCERTIFIED_HARDWARE = 5
    UNCERTIFIED_RATE = 6
    UNCERTIFIED_DISTURBANCE = 7


TUBE_PARAMETERS = (
    replace(TAU, read_only=False),
    *TAU_CHANGE_PARAMETERS,
    Parameter("integral.rate", 0.0, "k of the integral gain k F(:, [h V]); 0: no integral action", "1/s", 0.0, 1.0),
    *EFFECTIVENESS_PARAMETERS,
    COUPLING_PARAMETER,
    Parameter("vehicle.digest", "", "digest of the vehicle flown; empty: the default one"),
    *FLOWN_NOTCH_PARAMETERS,
    *HARDWARE_PARAMETERS,
    Parameter(
        "tube.disturbance",
        [],
        "lower, then upper bounds of what W adds to the rigid states in a step; empty: not watched",
    ),
)
"""Parameters of the tube law besides those of the design; hardware and disturbance affect only the status."""


def tube_data(
    gains: np.ndarray, minimum: np.ndarray, maximum: np.ndarray, period: float = 1.0, **others: Any
) -> Struct:
    """Return the data of the law as the struct ``hsv_tube`` of the core, by default a feedback on x - x_r alone.

    Args:
        gains: (c, 2, 9) gains F diag(tau); each is used from its step in ``starts`` until the next gain's.
        minimum: (2) smallest inputs.
        maximum: (2) largest inputs.
        period: Control period T, s.
        others: ``starts`` (c), the first step of each gain; ``planned``, whether the error is that from the plan
            x_r + x_n, and not from x_r; ``filtered``, whether the pitch rate of the plan passes the ``notch`` filter;
            ``integral_rate`` (1/s); ``effectiveness``, the data of its estimator.
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
    """Return data for flights with another controller than the tube law: zero gains and the limits of ``vehicle``."""
    return tube_data(np.zeros((1, N_INPUTS, N_STATES)), vehicle.input_minimum, vehicle.input_maximum)


def tube_memory() -> np.ndarray:
    """Return memory for the states of the law, a record ``hsv_tube_memory``; step 0 initialises it."""
    return np.zeros((), dtype("hsv_tube_memory"))


class TubeStep:
    """The step of the law in the core, with its memory and the arrays to which the core has pointers.

    The pointers are made once, because making them takes longer than the step.
    """

    def __init__(self, memory: np.ndarray | None = None, *, monitored: bool = True) -> None:
        """Prepare the step.

        Args:
            memory: States of the law, see :func:`tube_memory`; None: those before step 0.
            monitored: Whether to step the notch filter of the plan even if the law itself does not need it.
        """
        self.memory, self.monitored = tube_memory() if memory is None else memory, monitored
        sizes = (N_STATES, N_STATES, N_INPUTS, N_STATES, N_INPUTS, 2 * lib.MAX_SECTIONS)
        self._given = [np.zeros(size) for size in sizes]
        self._answer = np.zeros((3, N_INPUTS))
        self._pointers = [*map(doubles, (*self._given, *self._answer))]
        self._state = records("hsv_tube_memory", self.memory)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(TubeStep, monitored=self.monitored), (self.memory,)

    def __call__(self, data: Struct, inputs: ControllerInput) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """Return feedback, unsaturated and limited input (2 each) of a step (eq. 21, 36), and the index of its gain.

        ``data`` is that of :func:`tube_data`.
        """
        k, feedback_state, q_f, *others, filter_state = inputs
        for array, value in zip(self._given, (feedback_state, *others), strict=False):
            array[:] = value
        self._given[-1][: len(filter_state)] = filter_state
        x, *pointers = self._pointers
        active = lib.hsv_tube_step(data.pointer, self._state, k, self.monitored, len(filter_state), x, q_f, *pointers)
        feedback, unsaturated, limited = self._answer.copy()
        return feedback, unsaturated, limited, int(active)


def active_gain(data: Struct, step: int) -> int:
    """Return the index of the gain in ``data`` that is active in ``step``."""
    return max(int(np.searchsorted(data.starts, step, side="right")) - 1, 0)


@dataclass(frozen=True)
class TubeResult(ControllerResult):
    """Result of a step of the tube law with diagnostics; the message TubeStatus describes the fields.

    ``error`` e (n) is that of the rigid states and, if the loop has a notch filter, of its states. Without an invariant
    set, ``tube_centre`` c and ``tube_half_width`` (n) are empty, ``level`` is NaN and ``inside`` is false. Outside the
    set, ``component`` names the component of e - c that is largest relative to its half-width. ``tau`` holds one factor
    for all rigid states or one for each (5). ``effectiveness`` is None if it is not estimated.
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


class DisturbanceMonitor:
    """A monitor of the disturbance Delta = e(k+1) - A(p) e(k) - B(p) (u - u_r - u_n) of each step (eq. 13 to 18)."""

    def __init__(self, design: ControlDesign, bounds: np.ndarray) -> None:
        """Watch flights of ``design``; ``bounds`` (2, 5) are the lower and upper ones of Delta, SI."""
        self._polytope, self._bounds = design.polytope.data(), bounds.T.tolist()
        self._expected, self._no_defect = np.zeros(N_STATES), np.zeros(N_STATES)
        self.reset()

    def reset(self) -> None:
        """Prepare a new flight, whose first step has no disturbance yet."""
        self._expected[:] = np.nan

    def leaves(self, inputs: ControllerInput, error: np.ndarray, u: np.ndarray) -> bool:
        """Return whether the disturbance that led to ``error`` e (5) is outside W; predict the next e, with input u."""
        delta = error - self._expected[:N_RIGID]
        self._expected[:N_RIGID], self._expected[N_RIGID:] = error, 0.0
        given = map(doubles, (self._expected, u - inputs.reference_input - inputs.nominal_input, self._no_defect))
        lib.hsv_nominal_advance(self._polytope.pointer, *inputs.estimate[:2], *given)
        return any(d < low or d > high for d, (low, high) in zip(delta.tolist(), self._bounds, strict=True))


class TubeLaw(Controller):
    """The Tube-MPC law, with a monitor of whether the error is in the invariant set."""

    PARAMETERS = (*TUBE_PARAMETERS, *(p for p in WATCHED_PARAMETERS if p is not COUPLING_PARAMETER))
    in_core = True
    kernel: Struct
    design: ControlDesign
    factors: list[tuple[int, np.ndarray]]
    """First step and tau (5) of each gain of the kernel."""
    monitor: DisturbanceMonitor | None = None
    """The monitor of W, if the bounds are given."""

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
        """Set up the law for a flight with ``design``.

        Args:
            design: Design of the law.
            coupling: Set of inertial coupling of the vehicle; ``None``: that for which the design is certified.
            notch: Notch filter of the flight, by default the design's. The invariant set does not hold for another one.
            changes: First step and factors (5) of each change of tau, in order.
            integral_rate: k (1/s) of the integral gain K_i = k F(:, [h V]); 0: no integral action.
            vehicle: Digest of the vehicle; ``None``: the vehicle for which the design is certified.
            hardware_covered: Whether the design is certified for the hardware of the flight.
            effectiveness: Estimator of the elevator effectiveness, if any.
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
        self._step = TubeStep()

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign) -> Self:
        """Build from ``design`` and the flat parameters ``values``, of which :data:`TUBE_PARAMETERS` are used."""
        v = validate(TUBE_PARAMETERS, values)
        changes = scheduled_changes(values, design.tau_minimum, design.period)
        vehicle = v["vehicle.digest"]
        covered = not uncovered_hardware(values, design)
        watch = effectiveness_data(values, design.period)
        sections, rate = flown_sections(values), v["integral.rate"]
        law = cls(design, v["vehicle.coupling"], sections, changes, rate, vehicle, covered, watch)
        if v["tube.disturbance"]:
            law.monitor = DisturbanceMonitor(design, shaped(v, "tube.disturbance", (2, N_RIGID)))
        return law

    @property
    def gain(self) -> np.ndarray:
        """The gain F diag(tau) (2, 9) of the next step."""
        return np.asarray(self.kernel.gains[active_gain(self.kernel, self._next)])

    def reset(self) -> None:
        """Prepare a new flight from step 0, in which all scheduled changes of tau apply again.

        Until the first of them, tau is that of the last :meth:`change_tau`, or of the design if there was none.
        """
        self._next, self._before = 0, np.full(2, np.nan)
        if self.monitor:
            self.monitor.reset()
        self._arrange([(0, self._tau), *self._scheduled])

    def change_tau(self, values: Sequence[float]) -> int:
        """Use the factors tau ``values``, one or five, from the next step until another change; return the next step.

        Raises:
            ParameterError: The factors are not certified.
        """
        self._tau = certified(values, self.design.tau_minimum)
        past = [entry for entry in self.factors if entry[0] < self._next]
        to_come = [entry for entry in self.factors if entry[0] > self._next]
        self._arrange([*past, (self._next, self._tau), *to_come])
        return self._next

    def _arrange(self, factors: list[tuple[int, np.ndarray]]) -> None:
        """Rebuild the data of the law for these ``factors``: first step and tau (5) of each gain."""
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
        """Return the input of this step with diagnostics; the first step of a flight has number 0.

        Raises:
            SignalError: ``inputs.filter_state`` is not empty, and its size does not fit the notch filter of the flight.
        """
        k, filter_state = inputs.step, inputs.filter_state
        size, due = len(filter_state), 2 * len(self._notch.D)
        if size not in (0, due):
            raise SignalError(
                "filter_state", f"filter_state: {size} numbers, expected {due} of the notch filter flown, or none"
            )
        in_loop = size == due
        planned = filter_state if k == 0 else self._step.memory["planned"][:size].copy()
        feedback, total, u, active = self._step(self.kernel, inputs)
        self._next = k + 1
        error, tube = (inputs.estimate - inputs.reference - inputs.deviation)[:N_RIGID], None
        leaves_w = self.monitor is not None and self.monitor.leaves(inputs, error, u)
        if in_loop:
            error, tube = np.concatenate((error, filter_state - planned)), self._tube
        tube_level = ellipsoid_level(tube.shape, error - tube.centre) if tube else math.nan
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
        elif not self._hardware_covered:
            status = TubeStatusCode.UNCERTIFIED_HARDWARE
        elif leaves_w:
            status = TubeStatusCode.UNCERTIFIED_DISTURBANCE
        else:
            fast = len(tube.rates) and any(tube.too_fast(inputs.estimate[:2] - self._before, self.design.period))
            status = TubeStatusCode.UNCERTIFIED_RATE if fast else TubeStatusCode.OK
        self._before = inputs.estimate[:2].copy()
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
            effectiveness=effectiveness_in(self._step.memory) if self._effectiveness else None,
        )
