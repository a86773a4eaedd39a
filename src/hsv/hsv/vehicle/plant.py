"""The simulated vehicle, one control period at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np

from hsv.errors import ParameterError, QuantityError
from hsv.parameters import Parameter, check_all
from hsv.vehicle.dynamics import forces
from hsv.vehicle.envelope import in_model_range
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.parameters import COEFFICIENT_UNITS, MODELS, VehicleParameters
from hsv.vehicle.trim import Trim, trim
from hsv.vehicle.vehicle import COUPLING_PARAMETER, VEHICLE_PARAMETERS, Vehicle


class FlightStatus(IntEnum):
    """Whether more states follow; values of VehicleState.status."""

    RUNNING = 0
    FINISHED = 1
    DIVERGED = 2


PLANT_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, 1.0),
    Parameter("substeps", 2, "Runge-Kutta steps per control period", "", 1, 100),
    Parameter("duration", 200.0, "simulated time to fly", "s", 0.0, 1e5),
    Parameter("vehicle.model", "CM", "coupled model (paper eq. 1) or decoupled model (eq. 4)", choices=MODELS),
    COUPLING_PARAMETER,
    Parameter("initial.altitude", 26060.4, "altitude of the initial trim, in the vehicle's range", "m"),
    Parameter("initial.velocity", 2407.92, "velocity of the initial trim, in the vehicle's range", "m/s"),
    *(
        Parameter(f"vehicle.perturbation.{name}", 0.0, f"relative change of {name.replace('_', ' ')}", "", -0.9, 10.0)
        for name in COEFFICIENT_UNITS
    ),
)
"""Beside :data:`hsv.vehicle.vehicle.VEHICLE_PARAMETERS`."""


@dataclass(frozen=True)
class PlantResult:
    """One state x (9); lift N, drag N, thrust N, pitching moment N m and dynamic pressure Pa there; the status."""

    step: int
    state: np.ndarray
    forces: tuple[float, float, float, float, float]
    status: FlightStatus


class Plant:
    """The vehicle under held inputs. It starts in the trim of the *nominal* vehicle, perturbed or not."""

    PARAMETERS = (*PLANT_PARAMETERS, *VEHICLE_PARAMETERS)

    def __init__(self, vehicle: VehicleParameters, initial: Trim, period: float, steps: int, substeps: int = 2) -> None:
        self.vehicle = vehicle
        self.initial = initial
        self.period = period
        self.steps = steps
        self.substeps = substeps
        self._work = workspace()
        self.reset()
        self.step(initial.input)  # compile now: a cold cache must not stall a flight
        self.reset()

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build from :data:`PLANT_PARAMETERS` and those of the vehicle.

        Raises:
            ParameterError, TrimError: A wrong value, named.
        """
        v = check_all(PLANT_PARAMETERS, values)
        flown = Vehicle.from_parameters(values)
        flown.check_envelope(PLANT_PARAMETERS, v)
        try:
            nominal = flown.coupled(v["vehicle.coupling"])
        except QuantityError as error:
            raise ParameterError(f"parameter vehicle.{error}") from error
        if v["vehicle.model"] == "DM":
            nominal = nominal.decoupled()
        vehicle = nominal.perturbed({n: v[f"vehicle.perturbation.{n}"] for n in COEFFICIENT_UNITS})
        initial = trim(nominal, v["initial.altitude"], v["initial.velocity"])
        return cls(vehicle, initial, v["period"], round(v["duration"] / v["period"]), v["substeps"])

    def reset(self) -> PlantResult:
        """Return to the initial trim; return that state."""
        self._state = self.initial.state.copy()
        self._step = 0
        return self._result(self.initial.input)

    def place(self, step: int, state: np.ndarray) -> None:
        """Go on from ``state`` (9) at ``step``, as a replay does with what was recorded."""
        self._state[:] = state
        self._step = step

    def step(self, actuator: np.ndarray) -> PlantResult:
        """Hold ``actuator`` (2) over one period and return the state at its end."""
        advance(self._state, actuator, self.vehicle, self.period, self.substeps, self._work)
        self._step += 1
        return self._result(actuator)

    def _result(self, held: np.ndarray) -> PlantResult:
        if not in_model_range(self._state, self.vehicle.angle_limit):
            status = FlightStatus.DIVERGED
        elif self._step >= self.steps:
            status = FlightStatus.FINISHED
        else:
            status = FlightStatus.RUNNING
        return PlantResult(self._step, self._state.copy(), forces(self._state, held, self.vehicle), status)
