"""State estimator for noisy sensors: an extended Kalman filter with constant gain, see ``core/estimator.h``.

The filter predicts with the equations of motion of the nominal vehicle under the previous command, and corrects with
the steady-state gain at the initial trim of the flight. Besides the nine states it estimates an offset of each input,
which compensates model errors: a fault, another vehicle, wind. It uses only the measurements of the rigid states.
Controller and notch filter receive the estimate instead of the measurement. The nominal model is scheduled by the
measured altitude and velocity, because waiting for the estimate would delay every step.

The gain is computed by iterating the Riccati equation in arithmetic that is the same on every processor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

import numpy as np

from hsv.base.errors import DesignError, ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.core import Struct, doubles, lib, vector
from hsv.model.dynamics import VehicleParameters, jacobian, vehicle_struct
from hsv.model.sensors import SENSOR_PARAMETERS, sensor_data
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_RIGID, N_STATES, STATE_NAMES, STATE_UNITS
from hsv.model.trim import INITIAL_PARAMETERS, Trim, initial_trim
from hsv.model.vehicle import VEHICLE_PARAMETERS

ESTIMATOR_ENABLED = Parameter(
    "estimator.enabled", False, "true: the controller receives an estimate instead of the measurement"
)

_DRIVING = (7e-3, 7e-2, 2e-5, 7e-7, 7e-5, 7e-3, 7e-2, 7e-3, 7e-2, 7e-4, 1e-2)
_ESTIMATED = tuple(zip((*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS), strict=True))

NOISE_PARAMETERS = tuple(
    Parameter(
        f"estimator.noise.{name}",
        0.0,
        "standard deviation of the measurement; 0: the sensor's",
        unit,
        0.0,
        1e6,
        needs=ESTIMATOR_ENABLED.name,
    )
    for name, unit in _ESTIMATED[:N_RIGID]
)
PROCESS_PARAMETERS = tuple(
    Parameter(
        f"estimator.process.{name}",
        driving,
        "noise that drives the state, after one second" if name in STATE_NAMES else "the same, of the input's offset",
        f"{unit}/s^0.5",
        1e-12,
        1e6,
        needs=ESTIMATOR_ENABLED.name,
    )
    for (name, unit), driving in zip(_ESTIMATED, _DRIVING, strict=True)
)
ESTIMATOR_PARAMETERS = (ESTIMATOR_ENABLED, *NOISE_PARAMETERS, *PROCESS_PARAMETERS)


N_ESTIMATED = N_STATES + N_INPUTS
"""Number of estimated quantities: the nine states and an offset of each input."""

_SENSED = ("sensors.set", *(f"sensors.{name}.noise" for name in STATE_NAMES[:N_RIGID]))
"""Names of the parameters from which the noise of the sensors follows."""

_SETTLED = 1e-12
"""Largest relative change of the gain in an iteration at which it counts as converged."""
_MAX_ITERATIONS = 100_000


def estimator_data(
    values: Mapping[str, object], noise: np.ndarray, vehicle: VehicleParameters, start: Trim, period: float
) -> Struct:
    """Return the data of the estimator as the struct ``hsv_estimator`` of the core.

    Args:
        values: Flat parameters, of which :data:`ESTIMATOR_PARAMETERS` are used.
        noise: (9) standard deviations of the sensors' white noise, SI; used where ``values`` have none.
        vehicle: Nominal vehicle, with which the estimator predicts.
        start: Equilibrium in which the flight and the estimate start, and for which the gain is computed.
        period: Control period T, s.

    Raises:
        ParameterError: A value is wrong, or a measured rigid state has no noise.
        DesignError: The iteration of the gain does not converge.
    """
    v = validate(ESTIMATOR_PARAMETERS, values)
    deviations = np.array([v[p.name] or sensed for p, sensed in zip(NOISE_PARAMETERS, noise[:N_RIGID], strict=True)])
    lacking = [name for name, deviation in zip(STATE_NAMES[:N_RIGID], deviations, strict=True) if not deviation > 0.0]
    if lacking:
        raise ParameterError(
            f"parameter {ESTIMATOR_ENABLED.name} = true: no noise of {', '.join(lacking)}, expected estimator.noise "
            "of each, or sensors with noise, such as sensors.set = 'fine'"
        )
    process = np.array([v[p.name] for p in PROCESS_PARAMETERS])
    A, B = jacobian(start.state, start.input, vehicle)
    gain = np.empty((N_ESTIMATED, N_RIGID))
    given = [doubles(vector(each)) for each in (A, B, process * np.sqrt(period), deviations)]
    iterations = lib.hsv_steady_gain(*given[:2], period, *given[2:], _MAX_ITERATIONS, _SETTLED, doubles(gain))
    if iterations >= _MAX_ITERATIONS or not np.isfinite(gain).all():
        raise DesignError(f"estimator: no steady gain after {iterations} iterations, expected other noise")
    return Struct(
        "hsv_estimator", gain=gain, start=start.state.copy(), vehicle=vehicle_struct(vehicle), period=period, substeps=2
    )


class Estimator:
    """The state estimator of a flight, to be stepped once per control period."""

    PARAMETERS = (
        *ESTIMATOR_PARAMETERS,
        *INITIAL_PARAMETERS,
        *(p for p in SENSOR_PARAMETERS if p.name in _SENSED),
        *VEHICLE_PARAMETERS,
    )

    def __init__(self, data: Struct) -> None:
        self.data = data
        self._state = np.zeros(N_ESTIMATED)

    @classmethod
    def from_parameters(cls, values: Mapping[str, object], period: float) -> Self:
        """Build from the flat parameters ``values``, of which :attr:`PARAMETERS` are used; ``period`` in s."""
        nominal, start = initial_trim(values)
        sensed = sensor_data({name: values[name] for name in _SENSED if name in values}, period)
        return cls(estimator_data(values, sensed.noise, nominal, start, period))

    def step(self, step: int, measurement: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return the estimate (9) of the state in ``step``.

        ``measurement`` (9) is that of this step, ``command`` (2) that of the step before.
        """
        estimate = np.empty(N_STATES)
        given = (doubles(vector(measurement), N_STATES), doubles(vector(command), N_INPUTS), doubles(estimate))
        lib.hsv_estimate(self.data.pointer, doubles(self._state), step, *given)
        return estimate
