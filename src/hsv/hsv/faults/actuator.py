"""Actuator faults: one table of types, a schedule of faults, and the object that applies it step by step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numba import njit

from hsv.errors import ParameterError
from hsv.parameters import Parameter, check_all
from hsv.vehicle.dynamics import INPUT_NAMES

NEVER = 2**62
"""A step that is not reached."""


@dataclass(frozen=True)
class FaultType:
    """One kind of fault: its code for :func:`faulty`, what its parameter is called and means, what that may be."""

    code: int
    parameter: str
    meaning: str
    minimum: float
    maximum: float


FAULT_TYPES = {
    "loss_of_effectiveness": FaultType(
        0, "effectiveness", "the actuator moves by value times the command (paper eq. 15)", 0.0, 1.0
    ),
}
"""The vocabulary: parser, help text and documentation are made from it."""


@njit(cache=True)
def faulty(code: int, value: float, command: float) -> float:
    """Return what the actuator does with ``command`` under a fault of type ``code``."""
    if code == 0:
        return value * command
    return command


@dataclass(frozen=True)
class Fault:
    """A fault of one channel of the control input.

    Raises:
        ParameterError: Unknown channel or type, or a value the type does not admit.
    """

    channel: str
    type: str
    value: float

    def __post_init__(self) -> None:
        if self.channel not in INPUT_NAMES:
            raise ParameterError(f"fault.channel = {self.channel!r}: expected one of {', '.join(INPUT_NAMES)}")
        if self.type not in FAULT_TYPES:
            raise ParameterError(f"fault.type = {self.type!r}: expected one of {', '.join(FAULT_TYPES)}")
        kind = FAULT_TYPES[self.type]
        if not (math.isfinite(self.value) and kind.minimum <= self.value <= kind.maximum):
            raise ParameterError(
                f"fault.value = {self.value!r}: expected {kind.minimum:g} to {kind.maximum:g} for {self.type}"
            )

    @classmethod
    def of(cls, channel: str, kind: str, parameters: Mapping[str, float]) -> Self:
        """Return the fault with these ``parameters`` of its type, by name.

        Raises:
            ParameterError: As above, or a parameter is missing or not one of the type.
        """
        due = FAULT_TYPES[kind].parameter if kind in FAULT_TYPES else ""
        if due and [*parameters] != [due]:
            raise ParameterError(f"fault.parameters = {', '.join(parameters) or 'none'}: expected {due} for {kind}")
        return cls(channel, kind, parameters.get(due, math.nan))

    def __str__(self) -> str:
        return f"{self.type} {self.value:g} of {self.channel}"

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters of its type, by name."""
        return {FAULT_TYPES[self.type].parameter: self.value}


class FaultSchedule(NamedTuple):
    """Faults for compiled functions, a row each: steps [start, stop), channel, type code, value; later rows win."""

    start: np.ndarray
    stop: np.ndarray
    channel: np.ndarray
    code: np.ndarray
    value: np.ndarray


@njit(cache=True)
def apply_faults(schedule: Any, step: int, command: np.ndarray, actuator: np.ndarray) -> None:
    """Write into ``actuator`` (2) what becomes of ``command`` (2) in this step (paper eq. 14, eq. 15)."""
    for i in range(len(command)):
        actuator[i] = command[i]
    for row in range(len(schedule.start)):
        if schedule.start[row] <= step < schedule.stop[row]:
            channel = schedule.channel[row]
            actuator[channel] = faulty(schedule.code[row], schedule.value[row], command[channel])


FAULT_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, 1.0),
    Parameter("fault.channels", ["none"], "actuator of each scheduled fault, or one 'none'"),
    Parameter("fault.types", ["none"], "type of each scheduled fault: " + ", ".join(FAULT_TYPES)),
    Parameter("fault.values", [0.0], "value of each scheduled fault"),
    Parameter("fault.starts", [0.0], "simulated time at which each scheduled fault begins", "s", 0.0),
    Parameter("fault.stops", [], "simulated time at which each scheduled fault ends; empty: never", "s", 0.0),
)
NEVER_TIME = 1e9
"""Stop (s) of a fault that does not end, where others do."""


@dataclass
class _Entry:
    fault: Fault
    start: int
    stop: int = NEVER


@dataclass(frozen=True)
class FaultResult:
    """What the actuators do (2), and the faults acting in this step."""

    actuator: np.ndarray
    active: tuple[Fault, ...]


@dataclass
class FaultInjector:
    """Applies scheduled faults, and those injected or cleared in flight, which act from the next step on."""

    PARAMETERS: ClassVar = FAULT_PARAMETERS

    scheduled: Sequence[tuple[Fault, int] | tuple[Fault, int, int]] = ()
    """Faults with their first step and, if they end, the first step without."""

    def __post_init__(self) -> None:
        self.reset()
        self.step(0, np.zeros(2))  # compile now: a cold cache must not stall a flight
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build from :data:`FAULT_PARAMETERS`.

        Raises:
            ParameterError: A wrong value, or arrays of different lengths.
        """
        v = check_all(FAULT_PARAMETERS, values)
        names = ("channels", "types", "values", "starts", "stops")
        columns = [v[f"fault.{name}"] for name in names]
        if columns[0] == ["none"]:
            return cls()
        columns[-1] = list(columns[-1]) or [NEVER_TIME] * len(columns[0])
        for name, column in zip(names, columns, strict=True):
            if len(column) != len(columns[0]):
                raise ParameterError(
                    f"parameter fault.{name}: {len(column)} values, "
                    f"expected as many as fault.channels, {len(columns[0])}"
                )
        return cls(
            [
                (Fault(channel, kind, value), first_step(start, v["period"]), first_step(stop, v["period"]))
                for channel, kind, value, start, stop in zip(*columns, strict=True)
            ]
        )

    def reset(self) -> None:
        """Return to the schedule: what was injected or cleared in flight is forgotten."""
        self._entries = [_Entry(*row) for row in self.scheduled]
        self._next = 0
        self._compile()

    @property
    def schedule(self) -> FaultSchedule:
        """The faults known now, for compiled functions."""
        return self._schedule

    def parameters(self, period: float) -> dict[str, list[str] | list[float]]:
        """Return the faults known now, those injected or cleared in flight included, as :data:`FAULT_PARAMETERS`."""
        if not self._entries:
            return {"fault.channels": ["none"]}
        return {
            "fault.channels": [e.fault.channel for e in self._entries],
            "fault.types": [e.fault.type for e in self._entries],
            "fault.values": [e.fault.value for e in self._entries],
            "fault.starts": [e.start * period for e in self._entries],
            "fault.stops": [min(e.stop * period, NEVER_TIME) for e in self._entries],
        }

    def inject(self, fault: Fault, steps: int = NEVER) -> int:
        """Start ``fault`` with the next step, for so many, in place of what acts on its channel; return that step."""
        self.clear(fault.channel)
        self._entries.append(_Entry(fault, self._next, min(self._next + steps, NEVER)))
        self._compile()
        return self._next

    def clear(self, channel: str = "") -> int:
        """End the faults acting on ``channel`` (all channels if empty) with the next step; return that step.

        Raises:
            ParameterError: Unknown channel.
        """
        if channel and channel not in INPUT_NAMES:
            raise ParameterError(f"channel = {channel!r}: expected one of {', '.join(INPUT_NAMES)}, or empty for all")
        for entry in self._entries:
            if entry.start <= self._next < entry.stop and channel in ("", entry.fault.channel):
                entry.stop = self._next
        self._compile()
        return self._next

    def step(self, step: int, command: np.ndarray) -> FaultResult:
        """Return what becomes of ``command`` (2) in ``step``."""
        actuator = np.empty(2)
        apply_faults(self._schedule, step, command, actuator)
        self._next = step + 1
        return FaultResult(actuator, self.acting(step))

    def acting(self, step: int) -> tuple[Fault, ...]:
        """Return the faults that act in ``step``, one a channel: the last known wins."""
        return tuple({e.fault.channel: e.fault for e in self._entries if e.start <= step < e.stop}.values())

    def _compile(self) -> None:
        rows = self._entries
        self._schedule = FaultSchedule(
            np.array([e.start for e in rows], np.int64),
            np.array([e.stop for e in rows], np.int64),
            np.array([INPUT_NAMES.index(e.fault.channel) for e in rows], np.int64),
            np.array([FAULT_TYPES[e.fault.type].code for e in rows], np.int64),
            np.array([e.fault.value for e in rows], np.float64),
        )


def first_step(time: float, period: float) -> int:
    """Return the first step k with k * ``period`` >= ``time`` (s), rounding of the division allowed for."""
    return math.ceil(time / period - 1e-9)
