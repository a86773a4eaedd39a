"""The simulated vehicle, one control period at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.compiled import bound, njit_in_flight
from hsv.faults.effectors import advance_equipped
from hsv.faults.laws import FaultRows, apply_engine_faults, fault_memory, fault_rows
from hsv.faults.schedule import ActiveFault, ScheduledFault
from hsv.faults.table import COMMAND, DYNAMICS, EFFECTOR, ENGINE_SIDE, SENSOR
from hsv.links import (
    COMPUTATION_PARAMETER,
    MEASUREMENT_LINK_PARAMETERS,
    LinkData,
    command_link,
    computation,
    link_state,
    measurement_link,
    receive,
)
from hsv.noise import SEED_PARAMETER
from hsv.parameters import Parameter, check_all
from hsv.sensors import SENSOR_PARAMETERS, SensorData, measure, sensor_data, sensor_state
from hsv.vehicle.actuators import ACTUATOR_PARAMETERS, SUBSTEPS, ActuatorData, actuator_data, actuators_at_rest
from hsv.vehicle.atmosphere import (
    ATMOSPHERE_PARAMETERS,
    AtmosphereData,
    atmosphere_data,
    atmosphere_state,
    atmosphere_step,
    speed_of_sound,
)
from hsv.vehicle.dynamics import N_STATES, air_relative, forces, forces_in
from hsv.vehicle.envelope import in_model_range
from hsv.vehicle.initial import INITIAL_PARAMETERS, initial_trim
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.parameters import COEFFICIENT_UNITS, VehicleParameters
from hsv.vehicle.trim import Trim
from hsv.vehicle.vehicle import VEHICLE_PARAMETERS


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
"""Parameters of everything that is ideal by default; the tables of a scenario are named after them."""


def check_equipment(values: Mapping[str, object], vehicle: VehicleParameters, period: float) -> None:
    """Refuse :data:`EQUIPMENT_PARAMETERS`, or those of the command's link, that do not fit one another.

    Raises:
        ParameterError: Names the one that is wrong.
    """
    actuator_data(values, vehicle, period)
    atmosphere_data(values, period)
    sensor_data(values, period)
    measurement_link(values)
    command_link(values, period)


CALM = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Conditions of :func:`hsv.vehicle.dynamics.forces_in` in still air, with an engine that works."""

_CALM = CALM.tolist()


class PlantData(NamedTuple):
    """The plant for compiled functions; ``period`` T (s).

    The actuators have the command of a period ``late`` substeps after its beginning.
    """

    vehicle: VehicleParameters
    period: float
    substeps: int
    actuators: ActuatorData
    atmosphere: AtmosphereData
    sensors: SensorData
    link: LinkData
    late: float
    seed: int


class PlantMemory(NamedTuple):
    """State of the plant between steps besides the state x, updated in place.

    Position and rate of the actuators (2, 2); what reached them last and what the vehicle was given last (2 each); the
    states of the atmosphere, of the sensors and of the link of the measurement; the conditions (7) of the last period;
    scratch.
    """

    actuators: np.ndarray
    command: np.ndarray
    effector: np.ndarray
    atmosphere: np.ndarray
    sensors: np.ndarray
    link: np.ndarray
    conditions: np.ndarray
    work: np.ndarray


class PlantFaults(NamedTuple):
    """Faults of actuators and effectors, of the engine and of the sensors, with their memories."""

    effector: FaultRows
    effector_memory: np.ndarray
    engine: FaultRows
    engine_memory: np.ndarray
    sensor: FaultRows
    sensor_memory: np.ndarray

    @classmethod
    def of(cls, scheduled: Sequence[ScheduledFault], period: float, before: PlantFaults | None = None) -> PlantFaults:
        """Return those among the ``scheduled``; what was known ``before`` keeps its memory."""
        found: list[Any] = []
        for i, sides in enumerate(((DYNAMICS, EFFECTOR), (ENGINE_SIDE,), (SENSOR,))):
            rows = fault_rows(sides, scheduled, period)
            earlier: Any = before[2 * i : 2 * i + 2] if before else (None, None)
            found += rows, fault_memory(rows, *earlier)
        return cls(*found)


@njit_in_flight(error_model="numpy")
def advance_plant(x: np.ndarray, actuator: np.ndarray, data: Any, memory: Any, faults: Any, step: int) -> None:
    """Replace ``x`` (9) in ``step`` by the state one period later.

    Args:
        x: State, replaced.
        actuator: What reaches the actuators (2), from then on held.
        data: :class:`PlantData`.
        memory: :class:`PlantMemory`.
        faults: :class:`PlantFaults`.
        step: k.
    """
    actuators, before, effector, atmosphere, _, _, conditions, work = memory
    air, period, substeps, seed = data.atmosphere, data.period, data.substeps, data.seed
    driven = (data.actuators, actuators, faults.effector, faults.effector_memory, step, seed, effector, work)
    if air.still and len(faults.engine.table) == 0:
        advance_equipped(x, actuator, data.vehicle, period, substeps, *driven, None, before, data.late)
        _hold(actuator, before)
        return
    if not air.still:
        atmosphere_step(air, atmosphere, step, seed, x[0], x[1], conditions[:3])
    speed, turn, _, _ = air_relative(x[1], x[3] - x[2], conditions[0], conditions[1])
    mach = speed / speed_of_sound(x[0])
    engine, engine_memory = faults.engine, faults.engine_memory
    apply_engine_faults(engine, engine_memory, step, seed, x[2] - turn, mach, actuator[0], conditions[3:])
    advance_equipped(x, actuator, data.vehicle, period, substeps, *driven, conditions, before, data.late)
    _hold(actuator, before)


@njit_in_flight(error_model="numpy", inline="always")
def _hold(actuator: np.ndarray, before: np.ndarray) -> None:
    for i in range(len(before)):
        before[i] = actuator[i]


@njit_in_flight(error_model="numpy")
def sense(x: np.ndarray, data: Any, memory: Any, faults: Any, step: int, measurement: np.ndarray) -> None:
    """Write into ``measurement`` (9) what comes of what sensors say of ``x`` (9); see :func:`advance_plant`."""
    if data.sensors.ideal and len(faults.sensor.table) == 0:
        for i in range(len(x)):
            measurement[i] = x[i]
    else:
        measure(data.sensors, memory.sensors, faults.sensor, faults.sensor_memory, step, data.seed, x, measurement)
    receive(data.link, memory.link, step, data.seed, measurement)


class PlantResult(NamedTuple):
    """The state x (9) of a step, what is measured of it (9), and what has led to it.

    Lift N, drag N, thrust N, pitching moment N m and dynamic pressure Pa there; where the effectors (2) were last; wind
    forward and up (m/s) and density for that of the model over the period before (3); the status.
    """

    step: int
    state: np.ndarray
    measurement: np.ndarray
    forces: tuple[float, float, float, float, float]
    effector: np.ndarray
    air: np.ndarray
    status: FlightStatus


class Plant:
    """The vehicle under held inputs, with its actuators and sensors and the link behind these, in its air.

    It starts in the trim of the *nominal* vehicle in still air, perturbed or not.
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
        """Take the vehicle from its ``initial`` trim through so many ``steps`` of a ``period`` (s).

        Args:
            vehicle: Parameters.
            initial: Initial state.
            period: T (s).
            steps: Number of steps of the flight.
            substeps: Runge-Kutta steps a period, while actuators are ideal.
            equipment: Values of :data:`EQUIPMENT_PARAMETERS`, and the seed; the rest is as by default: ideal.
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
            check_all((SEED_PARAMETER,), values)[SEED_PARAMETER.name],
        )
        self._in_model_range = bound(in_model_range)
        self._advance_ideal, self._advance_plant = bound(advance), bound(advance_plant)
        self._forces_in_calm, self._forces_in = bound(forces), bound(forces_in)
        self._sense = bound(sense)
        self.reset()
        # Compile now, also what a fault in flight would need: a cold cache must not stall a flight.
        self.step(initial.input)
        self._advance_plant(self._state, initial.input, self.data, self._memory, self._faults, 0)
        self._sense(self._state, self.data, self._memory, self._faults, 0, np.empty_like(self._state))
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build from :data:`PLANT_PARAMETERS` and those of the vehicle.

        Raises:
            ParameterError, TrimError: A wrong value, named.
        """
        v = check_all(PLANT_PARAMETERS, values)
        nominal, initial = initial_trim(values)
        vehicle = nominal.perturbed({n: v[f"vehicle.perturbation.{n}"] for n in COEFFICIENT_UNITS})
        equipment = {p.name: values[p.name] for p in (*EQUIPMENT_PARAMETERS, SEED_PARAMETER) if p.name in values}
        return cls(vehicle, initial, v["period"], round(v["duration"] / v["period"]), v["substeps"], equipment)

    def perturbed(self, perturbation: Mapping[str, float]) -> Plant:
        """Return the same with another vehicle, relative changes by parameter name; it starts in the same trim."""
        return self.varied(self.vehicle.perturbed(perturbation), self.data.seed)

    def varied(self, vehicle: VehicleParameters, seed: int) -> Plant:
        """Return the same with a ``vehicle`` of the same limits and another ``seed``; what these leave is shared."""
        other = copy(self)
        other.vehicle = vehicle
        other.data = self.data._replace(vehicle=vehicle, seed=seed)
        other.reset()
        return other

    def is_ideal(self, scheduled: Sequence[ScheduledFault]) -> bool:
        """Tell whether the equipment is ideal and the air still, and no fault in a schedule changes that."""
        data = self.data
        ideal = data.actuators.ideal and data.sensors.ideal and data.link.ideal
        in_time = data.atmosphere.still and data.late == 0.0
        return ideal and in_time and all(row.fault.kind.side == COMMAND for row in scheduled)

    def reset(self) -> PlantResult:
        """Return to the initial trim; return that state."""
        self._state = self.initial.state.copy()
        self._step = 0
        self._memory = self.memory()
        self._active: tuple[ActiveFault, ...] = ()
        self._faults = PlantFaults.of((), self.period)
        self._ideal = self.is_ideal(())
        return self._result()

    def memory(self) -> PlantMemory:
        """Return the memory with which a flight begins: actuators at rest in trim, still air."""
        held = self.initial.input
        air = atmosphere_state(self.data.atmosphere)
        sensors, link = sensor_state(), link_state(self.data.link, N_STATES)
        at_rest = actuators_at_rest(held)
        return PlantMemory(at_rest, held.copy(), held.copy(), air, sensors, link, CALM.copy(), workspace())

    def place(self, step: int, state: np.ndarray) -> None:
        """Go on from ``state`` (9) at ``step``, as a replay does with what was recorded."""
        self._state[:] = state
        self._step = step

    def step(self, actuator: np.ndarray, active: tuple[ActiveFault, ...] = ()) -> PlantResult:
        """Hold what reaches the actuators (2) over one period and return the state at its end.

        ``active``: the faults that are due; those of the command have acted already.
        """
        if active != self._active:
            known = [ScheduledFault(fault, since) for fault, since in active]
            self._faults = PlantFaults.of(known, self.period, self._faults)
            self._ideal = self.is_ideal(known)
            self._active = active
        self._advance(actuator)
        self._step += 1
        return self._result()

    def _advance(self, actuator: np.ndarray) -> None:
        data, memory = self.data, self._memory
        if not self._ideal:
            self._advance_plant(self._state, actuator, data, memory, self._faults, self._step)
            return
        # What advance_plant would do as well; but to hand it all its data takes longer than the step.
        effector = memory.effector
        np.minimum(np.maximum(actuator, data.actuators.minimum), data.actuators.maximum, out=effector)
        memory.actuators[:, 0], memory.actuators[:, 1] = effector, 0.0
        self._advance_ideal(self._state, effector, self.vehicle, self.period, data.substeps, memory.work, None)

    def _result(self) -> PlantResult:
        if not self._in_model_range(self._state, self.vehicle.angle_limit):
            status = FlightStatus.DIVERGED
        elif self._step >= self.steps:
            status = FlightStatus.FINISHED
        else:
            status = FlightStatus.RUNNING
        effector, conditions = self._memory.effector.copy(), self._memory.conditions.copy()
        if conditions.tolist() == _CALM:
            felt = self._forces_in_calm(self._state, effector, self.vehicle)
        else:
            *felt, _ = self._forces_in(conditions, self._state, effector, self.vehicle)
        measurement = self._state.copy()
        if not self._ideal:
            self._sense(self._state, self.data, self._memory, self._faults, self._step, measurement)
        return PlantResult(self._step, self._state.copy(), measurement, tuple(felt), effector, conditions[:3], status)
