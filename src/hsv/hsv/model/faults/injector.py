"""The fault injector: scheduled faults, faults injected or cleared in flight, and their effect on the command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError, one_of
from hsv.base.parameters import Parameter, check_lengths, validate
from hsv.core import Struct, doubles, lib
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.model.faults.schedule import ActiveFault, ScheduledFault, fault_rows
from hsv.model.faults.table import CHANNELS, COMMAND, FAULT_KINDS, SENSOR, Fault
from hsv.model.links import COMMAND_LINK_PARAMETERS, COMPUTATION_PARAMETER, command_link, link_state
from hsv.model.signals import N_INPUTS, NEVER, first_step
from hsv.model.trim import INITIAL_PARAMETERS, initial_trim
from hsv.model.vehicle import VEHICLE_PARAMETERS

FAULT_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, 1.0),
    SEED_PARAMETER,
    Parameter("fault.channels", ["none"], "channel of each scheduled fault, or one 'none'"),
    Parameter("fault.types", ["none"], "type of each scheduled fault: " + ", ".join(FAULT_KINDS)),
    Parameter("fault.parameters", ["none"], "parameters of each, SI, such as 'effectiveness=0.9', separated by commas"),
    Parameter("fault.starts", [0.0], "simulated time at which each scheduled fault begins", "s", 0.0),
    Parameter("fault.stops", [], "simulated time at which each scheduled fault ends; empty: never", "s", 0.0),
)
DURATION = Parameter("duration", 0.0, "time until a fault injected in flight ends; 0: until cleared", "s", 0.0, 1e5)
LINK_PARAMETERS = (COMPUTATION_PARAMETER, *COMMAND_LINK_PARAMETERS)
"""Parameters of the link from the controller to the injector."""

NEVER_TIME = 1e9
"""Stop (s) that a list of stops contains for a fault without an end."""


class FaultResult(NamedTuple):
    """The input that reaches the actuators, shape (2,), and the active faults.

    Faults of the command, actuators, effectors and engine act in this step, those of sensors on the next measurement.
    """

    actuator: np.ndarray
    active: tuple[ActiveFault, ...]


class FaultInjector:
    """Applies the faults of a schedule; in flight, faults can be injected or cleared from the next step on.

    Faults of the command are applied here, behind the link from the controller. The plant applies all other faults.
    """

    PARAMETERS = (*FAULT_PARAMETERS, *LINK_PARAMETERS, *INITIAL_PARAMETERS, *VEHICLE_PARAMETERS)

    def __init__(
        self,
        scheduled: Sequence[ScheduledFault] = (),
        period: float = 0.02,
        seed: int = 0,
        link: Struct | None = None,
        before: np.ndarray | None = None,
    ) -> None:
        """Prepare a flight with scheduled faults.

        Args:
            scheduled: Faults with their first step and the step after their last one.
            period: Control period T (s).
            seed: Seed of the flight.
            link: Link from the controller; None: an ideal link.
            before: Input, shape (2,), that the link delivers until a command has arrived; None: zeros.
        """
        for row in scheduled:
            row.fault.check_period(period)
        # Sensor faults act from step 1 on.
        self.scheduled = tuple(
            row._replace(start=max(row.start, 1)) if row.fault.kind.side == SENSOR else row for row in scheduled
        )
        self.period, self.seed = period, seed
        self.link = link or command_link({}, period)
        self._before = np.zeros(N_INPUTS) if before is None else before
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Return the injector that values of :attr:`PARAMETERS` describe.

        The parameters of the vehicle and of its initial trim are used only if the link is not ideal.
        """
        v = validate(FAULT_PARAMETERS, values)
        period, seed = v["period"], v[SEED_PARAMETER.name]
        link = command_link(values, period)
        flown = (period, seed, link, None if link.ideal else initial_trim(values)[1].input)
        if v["fault.channels"] == ["none"]:
            return cls((), *flown)
        v["fault.stops"] = v["fault.stops"] or [NEVER_TIME] * len(v["fault.channels"])
        names = [f"fault.{name}" for name in ("channels", "types", "parameters", "starts", "stops")]
        check_lengths(v, *names)
        scheduled = [
            ScheduledFault(
                Fault.of(channel, kind, read_parameters(text)), first_step(start, period), first_step(stop, period)
            )
            for channel, kind, text, start, stop in zip(*(v[name] for name in names), strict=True)
        ]
        return cls(scheduled, *flown)

    def with_seed(self, seed: int) -> FaultInjector:
        """Return an injector with the same schedule and another ``seed``."""
        other = copy(self)
        other.seed = seed
        other.reset()
        return other

    def reset(self) -> None:
        """Go back to step 0 and to the schedule, without what was injected or cleared in flight."""
        self.known = list(self.scheduled)
        self._next = 0
        self._rows = self.rows((COMMAND,))
        self._link_state = self.link_state()

    def link_state(self) -> np.ndarray:
        """Return the initial state of the link from the controller."""
        return link_state(self.link, N_INPUTS, self._before)

    def rows(self, sides: Sequence[str], earlier: Struct | None = None) -> Struct:
        """Return the faults on ``sides``, scheduled or injected, for the core; arguments as for :func:`fault_rows`."""
        return fault_rows(sides, self.known, self.period, earlier)

    def parameters(self) -> dict[str, list[str] | list[float]]:
        """Return the faults known now, as injected and cleared in flight, as values of the parameters ``fault.*``."""
        if not self.known:
            return {"fault.channels": ["none"]}
        return {
            "fault.channels": [row.fault.channel for row in self.known],
            "fault.types": [row.fault.type for row in self.known],
            "fault.parameters": [written_parameters(row.fault.parameters) for row in self.known],
            "fault.starts": [row.start * self.period for row in self.known],
            "fault.stops": [min(row.stop * self.period, NEVER_TIME) for row in self.known],
        }

    def inject(self, fault: Fault, steps: int = NEVER) -> int:
        """Start ``fault`` for ``steps`` steps; it replaces active faults of the same type and channel.

        Returns:
            The first step of the fault: the next step, or the one after it for a fault of a sensor.

        Raises:
            ParameterError: The period of an intermittent fault is shorter than the control period.
        """
        fault.check_period(self.period)
        self.clear(fault.channel, fault.type)
        start = self._first(fault)
        self.known.append(ScheduledFault(fault, start, min(start + steps, NEVER)))
        self._rows = self.rows((COMMAND,), self._rows)
        return start

    def clear(self, channel: str = "", kind: str = "") -> int:
        """End the active faults of ``channel`` and of type ``kind``; empty: all channels, all types.

        Returns:
            The first step without them: the next step, or the one after it if only faults of sensors end.

        Raises:
            ParameterError: The channel or the kind is unknown.
        """
        if channel and channel not in CHANNELS:
            raise ParameterError(f"channel = {channel!r}: expected {one_of(CHANNELS, channel, ', or empty for all')}")
        if kind and kind not in FAULT_KINDS:
            raise ParameterError(f"type = {kind!r}: expected {one_of(FAULT_KINDS, kind, ', or empty for all')}")
        ended = []
        for i, (fault, start, stop) in enumerate(self.known):
            if channel in ("", fault.channel) and kind in ("", fault.type) and start <= self._first(fault) < stop:
                ended.append(self._first(fault))
                self.known[i] = ScheduledFault(fault, start, ended[-1])
        self._rows = self.rows((COMMAND,), self._rows)
        return min(ended, default=self._next)

    def step(self, step: int, command: np.ndarray) -> FaultResult:
        """Return the input that reaches the actuators, for ``command``, shape (2,), in ``step``."""
        actuator = np.array(command, float)
        link, payload = self.link.pointer, doubles(actuator)
        lib.hsv_receive(link, doubles(self._link_state), len(self._link_state), step, self.seed, payload, N_INPUTS)
        lib.hsv_apply_command_faults(self._rows.pointer, step, self.seed, payload)
        self._next = step + 1
        return FaultResult(actuator, self.acting(step))

    def acting(self, step: int) -> tuple[ActiveFault, ...]:
        """Return the active faults of ``step``, see :class:`FaultResult`."""
        return tuple(
            ActiveFault(fault, start)
            for fault, start, stop in self.known
            if start <= (step + 1 if fault.kind.side == SENSOR else step) < stop
        )

    def _first(self, fault: Fault) -> int:
        """Return the first step from which ``fault`` can still be started or ended."""
        return self._next + 1 if fault.kind.side == SENSOR else self._next


def read_parameters(text: str) -> dict[str, float]:
    """Return the parameters of a fault (SI) by name from a text such as :func:`written_parameters` returns.

    Raises:
        ParameterError: The text has another form.
    """
    found = {}
    for entry in filter(None, text.split(",")):
        name, equals, number = entry.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise ParameterError(f"parameter fault.parameters: {text!r}, expected a form as 'effectiveness=0.9'")
    return found


def written_parameters(parameters: Mapping[str, Any]) -> str:
    """Return the ``parameters`` (SI) of a fault as text such as ``effectiveness=0.9``, without loss of bits."""
    return ",".join(f"{name}={float(value)!r}" for name, value in parameters.items())
