"""The simulated vehicle with its equipment, advanced by one control period at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from enum import IntEnum
from typing import NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.core import Struct, doubles, lib, vector
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.model.actuators import ACTUATOR_PARAMETERS, SUBSTEPS, actuator_data, actuators_at_rest
from hsv.model.atmosphere import ATMOSPHERE_PARAMETERS, atmosphere_data, atmosphere_state
from hsv.model.dynamics import COEFFICIENT_UNITS, VehicleParameters, forces, in_model_range, vehicle_struct
from hsv.model.faults.schedule import ActiveFault, ScheduledFault, fault_rows
from hsv.model.faults.table import COMMAND, DYNAMICS, EFFECTOR, ENGINE_SIDE, SENSOR
from hsv.model.links import (
    COMPUTATION_PARAMETER,
    MEASUREMENT_LINK_PARAMETERS,
    command_link,
    computation,
    link_state,
    measurement_link,
)
from hsv.model.sensors import SENSOR_PARAMETERS, sensor_data, sensor_state
from hsv.model.signals import N_INPUTS, N_STATES
from hsv.model.trim import INITIAL_PARAMETERS, Trim, initial_trim
from hsv.model.vehicle import VEHICLE_PARAMETERS


class FlightStatus(IntEnum):
    """Status of a flight, with the values of the message field ``VehicleState.status``."""

    RUNNING = 0
    FINISHED = 1
    DIVERGED = 2


MAX_STEPS, MAX_PERIOD = 5_000_000, 1.0
"""Largest number of steps of a flight, 100 000 s at the usual period of 0.02 s, and longest period (s)"""

PLANT_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, MAX_PERIOD),
    Parameter("substeps", 2, "Runge-Kutta steps per control period", "", 1, 100),
    Parameter("duration", 200.0, "simulated time to fly", "s", 0.0, 1e5),
    *INITIAL_PARAMETERS,
    *(
        Parameter(f"vehicle.perturbation.{name}", 0.0, f"relative change of {name.replace('_', ' ')}", "", -0.9, 10.0)
        for name in COEFFICIENT_UNITS
    ),
)
"""Parameters of the plant, without those of the vehicle and of :data:`EQUIPMENT_PARAMETERS`."""

EQUIPMENT_PARAMETERS = (
    *ACTUATOR_PARAMETERS,
    *ATMOSPHERE_PARAMETERS,
    *SENSOR_PARAMETERS,
    *MEASUREMENT_LINK_PARAMETERS,
    COMPUTATION_PARAMETER,
)
"""Parameters of actuators, air, sensors and links, ideal by default; a scenario has tables of the same names."""


def check_equipment(values: Mapping[str, object], vehicle: VehicleParameters, period: float) -> None:
    """Raise a ParameterError for a wrong value of :data:`EQUIPMENT_PARAMETERS` or of the command link."""
    actuator_data(values, vehicle, period)
    atmosphere_data(values, period)
    sensor_data(values, period)
    measurement_link(values)
    command_link(values, period)


CALM = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""The conditions of :func:`hsv.model.dynamics.forces` in still air with a working engine."""

_CALM = CALM.tolist()


def plant_faults(scheduled: Sequence[ScheduledFault], period: float, before: Struct | None = None) -> Struct:
    """Return the ``scheduled`` faults of the plant, for the core; those also in ``before`` keep their memory."""
    sides = {"effector": (DYNAMICS, EFFECTOR), "engine": (ENGINE_SIDE,), "sensor": (SENSOR,)}
    rows = {name: fault_rows(side, scheduled, period, before and getattr(before, name)) for name, side in sides.items()}
    return Struct("hsv_plant_faults", **rows)


class PlantResult(NamedTuple):
    """The true state of a step and its measurement, shape (9,) each, with forces, effectors and air.

    ``effector`` has fuel and elevator, ``air`` the wind forward and up (m/s) and the density relative to the model's,
    as last held before the step. ``forces`` follow from the state, these and faults of the engine: lift (N), drag (N),
    thrust (N), pitching moment (N m) and dynamic pressure (Pa).
    """

    step: int
    state: np.ndarray
    measurement: np.ndarray
    forces: tuple[float, float, float, float, float]
    effector: np.ndarray
    air: np.ndarray
    status: FlightStatus


class Plant:
    """The vehicle with its actuators, sensors, the link from the sensors, and the air; inputs are held over a period.

    It starts in the trim of the *nominal* vehicle in still air, even if the simulated vehicle is perturbed.
    """

    PARAMETERS = (*PLANT_PARAMETERS, *VEHICLE_PARAMETERS, *EQUIPMENT_PARAMETERS, SEED_PARAMETER)

    def __init__(
        self,
        vehicle: VehicleParameters,
        initial: Trim,
        period: float,
        steps: int,
        substeps: int = 2,
        equipment: Mapping[str, object] | None = None,
    ) -> None:
        """Prepare a flight from the ``initial`` trim.

        Args:
            vehicle: Parameters of the simulated vehicle.
            initial: Trim that gives the initial state and input.
            period: Control period T (s).
            steps: Number of control periods of the flight.
            substeps: Runge-Kutta steps per control period while the vehicle receives the command itself, see
                :mod:`hsv.model.actuators`.
            equipment: Values of :data:`EQUIPMENT_PARAMETERS`, and the seed; by default the equipment is ideal.
        """
        self.vehicle = vehicle
        self.initial = initial
        self.period = period
        self.steps = steps
        values = dict(equipment or {})
        self.data = Struct(
            "hsv_plant",
            vehicle=vehicle_struct(vehicle),
            period=period,
            substeps=substeps,
            actuators=actuator_data(values, vehicle, period),
            atmosphere=atmosphere_data(values, period),
            sensors=sensor_data(values, period),
            link=measurement_link(values),
            # Time from the beginning of a period until the actuators receive its command, in substeps.
            late=SUBSTEPS * computation(values, period)[1],
            seed=validate((SEED_PARAMETER,), values)[SEED_PARAMETER.name],
        )
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Return the plant with the given values of :attr:`PARAMETERS`; others are the named vehicle's or defaults."""
        v = validate(PLANT_PARAMETERS, values)
        nominal, initial = initial_trim(values)
        vehicle = nominal.perturbed({n: v[f"vehicle.perturbation.{n}"] for n in COEFFICIENT_UNITS})
        if (steps := round(v["duration"] / v["period"])) > MAX_STEPS:
            raise ParameterError(f"duration = {v['duration']:g} s: {steps} periods, expected at most {MAX_STEPS}")
        equipment = {p.name: values[p.name] for p in (*EQUIPMENT_PARAMETERS, SEED_PARAMETER) if p.name in values}
        return cls(vehicle, initial, v["period"], steps, v["substeps"], equipment)

    def perturbed(self, perturbation: Mapping[str, float]) -> Plant:
        """Return a plant whose vehicle has relative changes by parameter name; it starts in the same trim."""
        return self.varied(self.vehicle.perturbed(perturbation), self.data.seed)

    def varied(self, vehicle: VehicleParameters, seed: int) -> Plant:
        """Return a plant with another ``seed`` and another ``vehicle``, which must have the same limits.

        It flies in the core; before :meth:`step`, reset it.
        """
        other = copy(self)
        other.vehicle = vehicle
        other.data = self.data.replaced(vehicle=vehicle_struct(vehicle), seed=seed)
        return other

    def is_ideal(self, scheduled: Sequence[ScheduledFault]) -> bool:
        """Return whether equipment and air are ideal, no command is late, and ``scheduled`` has command faults only."""
        data = self.data
        ideal = data.actuators.ideal and data.sensors.ideal and data.link.ideal and data.atmosphere.still
        return ideal and data.late == 0.0 and all(row.fault.kind.side == COMMAND for row in scheduled)

    def reset(self) -> PlantResult:
        """Reset the flight to its initial trim and return the result of step 0."""
        self._state = self.initial.state.copy()
        self._step = 0
        self._memory = self.memory()
        self._active: tuple[ActiveFault, ...] = ()
        self._faults = plant_faults((), self.period)
        return self._result()

    def memory(self) -> Struct:
        """Return the equipment's state before step 0: actuators at rest in the trim, still air."""
        held = self.initial.input
        return Struct(
            "hsv_plant_memory",
            actuators=actuators_at_rest(held),
            command=held.copy(),
            effector=held.copy(),
            atmosphere=atmosphere_state(self.data.atmosphere),
            sensors=sensor_state(),
            link=link_state(self.data.link, N_STATES),
            conditions=CALM.copy(),
        )

    def place(self, step: int, state: np.ndarray) -> None:
        """Set the current step and ``state``, shape (9,), as a replay does with each recorded state."""
        self._state[:] = state
        self._step = step

    def step(self, actuator: np.ndarray, active: tuple[ActiveFault, ...] = ()) -> PlantResult:
        """Hold ``actuator``, the 2 inputs of the actuators, over one period and return the result at its end.

        ``active``: the active faults; those of the command have already been applied to ``actuator``.
        """
        if active != self._active:
            known = [ScheduledFault(fault, since) for fault, since in active]
            self._faults = plant_faults(known, self.period, self._faults)
            self._active = active
        blocks = self.data.pointer, self._memory.pointer, self._faults.pointer
        lib.hsv_advance_plant(*blocks, self._step, doubles(vector(actuator), N_INPUTS), doubles(self._state))
        self._step += 1
        return self._result()

    def _result(self) -> PlantResult:
        if not in_model_range(self._state, self.vehicle.angle_limit):
            status = FlightStatus.DIVERGED
        elif self._step >= self.steps:
            status = FlightStatus.FINISHED
        else:
            status = FlightStatus.RUNNING
        effector, conditions = self._memory.effector.copy(), self._memory.conditions.copy()
        calm = conditions.tolist() == _CALM
        felt = forces(self._state, effector, self.vehicle, None if calm else conditions)
        measurement = np.empty(N_STATES)
        blocks = self.data.pointer, self._memory.pointer, self._faults.pointer
        lib.hsv_sense(*blocks, self._step, doubles(self._state), doubles(measurement))
        return PlantResult(self._step, self._state.copy(), measurement, felt, effector, conditions[:3], status)
