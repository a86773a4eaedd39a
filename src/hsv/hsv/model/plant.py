"""The simulated vehicle, stepped by control periods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Self

import numpy as np

from hsv.base.parameters import Parameter, validate
from hsv.core import Data, Struct, doubles, lib, vector
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.model.actuators import ACTUATOR_PARAMETERS, SUBSTEPS, ActuatorData, actuator_data, actuators_at_rest
from hsv.model.atmosphere import (
    ATMOSPHERE_PARAMETERS,
    AtmosphereData,
    atmosphere_data,
    atmosphere_state,
)
from hsv.model.dynamics import COEFFICIENT_UNITS, VehicleParameters, forces, in_model_range
from hsv.model.faults.schedule import ActiveFault, FaultRows, ScheduledFault, fault_rows
from hsv.model.faults.table import COMMAND, DYNAMICS, EFFECTOR, ENGINE_SIDE, SENSOR
from hsv.model.links import (
    COMPUTATION_PARAMETER,
    MEASUREMENT_LINK_PARAMETERS,
    LinkData,
    command_link,
    computation,
    link_state,
    measurement_link,
)
from hsv.model.sensors import SENSOR_PARAMETERS, SensorData, sensor_data, sensor_state
from hsv.model.signals import N_INPUTS, N_STATES
from hsv.model.trim import INITIAL_PARAMETERS, Trim, initial_trim
from hsv.model.vehicle import VEHICLE_PARAMETERS


class FlightStatus(IntEnum):
    """Whether more states follow; values of VehicleState.status."""

    RUNNING = 0
    FINISHED = 1
    DIVERGED = 2


PLANT_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, 1.0),
    Parameter("substeps", 2, "Runge-Kutta steps per control period", "", 1, 100),
    Parameter("duration", 200.0, "simulated time to fly", "s", 0.0, 1e5),
    *INITIAL_PARAMETERS,
    *(
        Parameter(f"vehicle.perturbation.{name}", 0.0, f"relative change of {name.replace('_', ' ')}", "", -0.9, 10.0)
        for name in COEFFICIENT_UNITS
    ),
)
"""Parameters of the plant besides those of the vehicle, its actuators, sensors and links, and the air."""

EQUIPMENT_PARAMETERS = (
    *ACTUATOR_PARAMETERS,
    *ATMOSPHERE_PARAMETERS,
    *SENSOR_PARAMETERS,
    *MEASUREMENT_LINK_PARAMETERS,
    COMPUTATION_PARAMETER,
)
"""Parameters of the equipment, which is ideal by default; a scenario has tables of the same names."""


def check_equipment(values: Mapping[str, object], vehicle: VehicleParameters, period: float) -> None:
    """Check :data:`EQUIPMENT_PARAMETERS` and the parameters of the command's link.

    Raises:
        ParameterError: A wrong value, or values that contradict each other, named.
    """
    actuator_data(values, vehicle, period)
    atmosphere_data(values, period)
    sensor_data(values, period)
    measurement_link(values)
    command_link(values, period)


CALM = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Conditions of still air and a working engine"""

_CALM = CALM.tolist()


@dataclass(frozen=True, eq=False)
class PlantData(Data):
    """The plant for the core; ``period`` T (s).

    The actuators receive the command of a period ``late`` substeps after its beginning.
    """

    KIND = "hsv_plant"
    vehicle: VehicleParameters
    period: float
    substeps: int
    actuators: ActuatorData
    atmosphere: AtmosphereData
    sensors: SensorData
    link: LinkData
    late: float
    seed: int

    @property
    def ideal(self) -> bool:
        """Whether the equipment is ideal, the air still and the command in time."""
        ideal = self.actuators.ideal and self.sensors.ideal and self.link.ideal
        return ideal and self.atmosphere.still and self.late == 0.0


class PlantMemory(NamedTuple):
    """The memory of the plant besides the state x, updated in place.

    Position and rate of the actuators (2, 2); the command and the effectors of the period before (2 each); the memories
    of the atmosphere, of the sensors and of the link of the measurement; the conditions (7) of the last period.
    """

    actuators: np.ndarray
    command: np.ndarray
    effector: np.ndarray
    atmosphere: np.ndarray
    sensors: np.ndarray
    link: np.ndarray
    conditions: np.ndarray


class PlantFaults(NamedTuple):
    """Faults of actuators and effectors, of the engine and of the sensors."""

    effector: FaultRows
    engine: FaultRows
    sensor: FaultRows

    @classmethod
    def of(cls, scheduled: Sequence[ScheduledFault], period: float, before: PlantFaults | None = None) -> PlantFaults:
        """Return the ``scheduled`` faults by side; the faults in ``before`` keep their memory."""
        sides = ((DYNAMICS, EFFECTOR), (ENGINE_SIDE,), (SENSOR,))
        return cls._make(fault_rows(side, scheduled, period, before and before[i]) for i, side in enumerate(sides))


class PlantResult(NamedTuple):
    """The state x (9) of a step, its measurement (9), and forces, effectors and air that led to it.

    ``forces``: lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa. ``effector`` (2): last positions.
    ``air`` (3): wind forward and up (m/s), and density relative to the model's, over the period before.
    """

    step: int
    state: np.ndarray
    measurement: np.ndarray
    forces: tuple[float, float, float, float, float]
    effector: np.ndarray
    air: np.ndarray
    status: FlightStatus


class Plant:
    """The vehicle under held inputs, with its actuators, its sensors, their link, and the air.

    It starts in the trim of the *nominal* vehicle in still air, even if it is perturbed.
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
        """Prepare a flight from the ``initial`` trim over ``steps`` periods (s).

        Args:
            vehicle: Parameters.
            initial: Initial state.
            period: T (s).
            steps: Number of steps of the flight.
            substeps: Runge-Kutta steps a period, while actuators are ideal.
            equipment: Values of :data:`EQUIPMENT_PARAMETERS`, and the seed; the default is ideal equipment.
        """
        self.vehicle = vehicle
        self.initial = initial
        self.period = period
        self.steps = steps
        values = dict(equipment or {})
        self.data = PlantData(
            vehicle,
            period,
            substeps,
            actuator_data(values, vehicle, period),
            atmosphere_data(values, period),
            sensor_data(values, period),
            measurement_link(values),
            SUBSTEPS * computation(values, period)[1],
            validate((SEED_PARAMETER,), values)[SEED_PARAMETER.name],
        )
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build from :data:`PLANT_PARAMETERS` and those of the vehicle.

        Raises:
            ParameterError, TrimError: A wrong value, named.
        """
        v = validate(PLANT_PARAMETERS, values)
        nominal, initial = initial_trim(values)
        vehicle = nominal.perturbed({n: v[f"vehicle.perturbation.{n}"] for n in COEFFICIENT_UNITS})
        equipment = {p.name: values[p.name] for p in (*EQUIPMENT_PARAMETERS, SEED_PARAMETER) if p.name in values}
        return cls(vehicle, initial, v["period"], round(v["duration"] / v["period"]), v["substeps"], equipment)

    def perturbed(self, perturbation: Mapping[str, float]) -> Plant:
        """Return a plant with relative changes of the vehicle, by parameter name; it starts in the same trim."""
        return self.varied(self.vehicle.perturbed(perturbation), self.data.seed)

    def varied(self, vehicle: VehicleParameters, seed: int) -> Plant:
        """Return a plant with another ``vehicle`` of the same limits and another ``seed``; other data are shared."""
        other = copy(self)
        other.vehicle = vehicle
        other.data = self.data.replaced(vehicle=vehicle, seed=seed)
        other._begun = False
        return other

    def is_ideal(self, scheduled: Sequence[ScheduledFault]) -> bool:
        """Return whether equipment and air are ideal and stay so under the ``scheduled`` faults."""
        return self.data.ideal and all(row.fault.kind.side == COMMAND for row in scheduled)

    def reset(self) -> PlantResult:
        """Return to the initial trim; return that state."""
        self._begin()
        return self._result()

    def _begin(self) -> None:
        self._state = self.initial.state.copy()
        self._step = 0
        self._memory = self.memory()
        self._remembered = Struct("hsv_plant_memory", self._memory)
        self._active: tuple[ActiveFault, ...] = ()
        self._know(PlantFaults.of((), self.period))
        self._begun = True

    def memory(self) -> PlantMemory:
        """Return the memory with which a flight begins: actuators at rest in trim, still air."""
        held = self.initial.input
        air = atmosphere_state(self.data.atmosphere)
        sensors, link = sensor_state(), link_state(self.data.link, N_STATES)
        return PlantMemory(actuators_at_rest(held), held.copy(), held.copy(), air, sensors, link, CALM.copy())

    def _know(self, faults: PlantFaults) -> None:
        self._faults = faults
        self._known = Struct("hsv_plant_faults", faults)

    def place(self, step: int, state: np.ndarray) -> None:
        """Continue from ``state`` (9) at ``step``, as a replay does with recorded states."""
        if not self._begun:
            self._begin()
        self._state[:] = state
        self._step = step

    def step(self, actuator: np.ndarray, active: tuple[ActiveFault, ...] = ()) -> PlantResult:
        """Hold the input of the actuators (2) over one period and return the state at its end.

        ``active``: the active faults; those of the command have been applied already.
        """
        if not self._begun:
            self._begin()
        if active != self._active:
            known = [ScheduledFault(fault, since) for fault, since in active]
            self._know(PlantFaults.of(known, self.period, self._faults))
            self._active = active
        memory, faults = self._remembered.pointer, self._known.pointer
        given = doubles(vector(actuator), N_INPUTS), doubles(self._state)
        lib.hsv_advance_plant(self.data.pointer, memory, faults, self._step, *given)
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
        lib.hsv_sense(
            self.data.pointer,
            self._remembered.pointer,
            self._known.pointer,
            self._step,
            doubles(self._state),
            doubles(measurement),
        )
        return PlantResult(self._step, self._state.copy(), measurement, felt, effector, conditions[:3], status)
