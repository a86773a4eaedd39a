"""An estimator of the state for noisy sensors: an extended Kalman filter of constant gain, compiled.

It predicts with the equations of motion of the design's vehicle under the command of the step before, and corrects with
a gain that is the steady one about the trim where the flight starts. Beside the nine states it estimates an offset of
each input, which takes up what the model does not know: a fault, another vehicle, wind. Of the measurement it uses the
five rigid states; the elastic ones are predicted. Its estimate takes the measurement's place for the controller and the
notch filter. The nominal model is scheduled by altitude and velocity as measured: to wait for the estimate would be a
hop more in every step.

The gain is found by iterating the Riccati equation in arithmetic that is the same on every processor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.compiled import njit, njit_in_flight
from hsv.control.estimator_parameters import (
    ESTIMATOR_ENABLED,
    ESTIMATOR_PARAMETERS,
    NOISE_PARAMETERS,
    PROCESS_PARAMETERS,
)
from hsv.elimination import solve
from hsv.errors import DesignError, ParameterError
from hsv.parameters import check_all
from hsv.sensors import SENSOR_PARAMETERS, sensor_data
from hsv.vehicle.dynamics import N_INPUTS, N_RIGID, N_STATES, STATE_NAMES, jacobian
from hsv.vehicle.initial import INITIAL_PARAMETERS, initial_trim
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.trim import Trim
from hsv.vehicle.vehicle import VEHICLE_PARAMETERS

N_ESTIMATED = N_STATES + N_INPUTS
"""The states and an offset of each input."""

_SENSED = ("sensors.set", *(f"sensors.{name}.noise" for name in STATE_NAMES[:N_RIGID]))
"""Parameters that say how noisy the sensors are."""

_SETTLED = 1e-12
"""Relative change of the gain in an iteration, at most, where it is steady."""
_MOST_ITERATIONS = 100_000


class EstimatorData(NamedTuple):
    """The estimator for compiled functions: its ``gain`` (11, 5), the model ``vehicle``, how it is integrated."""

    gain: np.ndarray
    start: np.ndarray
    vehicle: VehicleParameters
    period: float
    substeps: int


def estimator_data(
    values: Mapping[str, object], noise: np.ndarray, vehicle: VehicleParameters, start: Trim, period: float
) -> EstimatorData:
    """Return the estimator that :data:`hsv.control.estimator_parameters.ESTIMATOR_PARAMETERS` describe.

    Args:
        values: Parameters.
        noise: Standard deviations of the sensors' white noise (9), for want of others.
        vehicle: Nominal vehicle of the design.
        start: Equilibrium in which the flight starts, which the estimator knows, and about which its gain is found.
        period: T (s).

    Raises:
        ParameterError: A wrong value, or a sensor without noise.
        DesignError: No steady gain was found.
    """
    v = check_all(ESTIMATOR_PARAMETERS, values)
    deviations = np.array([v[p.name] or sensed for p, sensed in zip(NOISE_PARAMETERS, noise[:N_RIGID], strict=True)])
    lacking = [name for name, deviation in zip(STATE_NAMES[:N_RIGID], deviations, strict=True) if not deviation > 0.0]
    if lacking:
        raise ParameterError(
            f"parameter {ESTIMATOR_ENABLED.name} = true: no noise of {', '.join(lacking)}, expected estimator.noise "
            "of each, or sensors with noise, such as sensors.set = 'fine'"
        )
    process = np.array([v[p.name] for p in PROCESS_PARAMETERS])
    A, B = jacobian(start.state, start.input, vehicle)
    gain, iterations = steady_gain(A, B, period, process * np.sqrt(period), deviations)
    if iterations >= _MOST_ITERATIONS or not np.isfinite(gain).all():
        raise DesignError(f"estimator: no steady gain after {iterations} iterations, expected other noise")
    return EstimatorData(gain, start.state.copy(), vehicle, period, 2)


def scratch() -> np.ndarray:
    """Return the array (4, 9) that :func:`estimate_step` wants: that of the integration and a row for the input."""
    return np.empty((len(workspace()) + 1, N_STATES))


@njit(cache=True, error_model="numpy")
def _product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return A B, summed in the order of the columns of ``A``."""
    result = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            for j in range(B.shape[1]):
                result[i, j] += A[i, k] * B[k, j]
    return result


@njit(cache=True, error_model="numpy")
def _transposed(A: np.ndarray) -> np.ndarray:
    result = np.empty((A.shape[1], A.shape[0]))
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            result[j, i] = A[i, j]
    return result


@njit(cache=True, error_model="numpy")
def transition(A: np.ndarray, B: np.ndarray, period: float) -> np.ndarray:
    """Return the matrix (n + m, n + m) that takes states and held inputs over a ``period`` (s), by its power series.

    Args:
        A: (n, n), continuous time.
        B: (n, m).
        period: s, so short that the series converges: eigenvalues of ``A`` of a few per period.
    """
    n, m = B.shape
    rates = np.zeros((n + m, n + m))
    for i in range(n):
        for j in range(n):
            rates[i, j] = A[i, j] * period
        for j in range(m):
            rates[i, n + j] = B[i, j] * period
    term = np.eye(n + m)
    total = np.eye(n + m)
    for order in range(1, 25):
        term = _product(term, rates)
        for i in range(n + m):
            for j in range(n + m):
                term[i, j] /= order
                total[i, j] += term[i, j]
    return total


@njit(cache=True, error_model="numpy")
def steady_gain(
    A: np.ndarray, B: np.ndarray, period: float, process: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, int]:
    """Return the steady Kalman gain (n + m, r) of states and input offsets, and the iterations that it took.

    Args:
        A: (n, n) of the vehicle, continuous time.
        B: (n, m).
        period: T (s).
        process: Standard deviations (n + m) of the noise that a period adds to states and offsets.
        noise: Standard deviations (r) of the measurement of the first r states.
    """
    F = transition(A, B, period)
    F_t = _transposed(F)
    size, measured = len(process), len(noise)
    P = np.zeros((size, size))
    gain = np.zeros((size, measured))
    for iteration in range(_MOST_ITERATIONS):
        M = _product(_product(F, P), F_t)
        for i in range(size):
            M[i, i] += process[i] * process[i]
        S, right = np.empty((measured, measured)), np.empty((measured, size))
        for i in range(measured):
            for j in range(measured):
                S[i, j] = M[i, j] + (noise[i] * noise[i] if i == j else 0.0)
            for j in range(size):
                right[i, j] = M[j, i]
        found = _transposed(solve(S, right))
        change = 0.0
        for j in range(measured):
            largest, moved = 0.0, 0.0
            for i in range(size):
                largest = max(largest, abs(found[i, j]))
                moved = max(moved, abs(found[i, j] - gain[i, j]))
            change = max(change, moved / largest)
        gain = found
        correction = _product(gain, M[:measured])
        for i in range(size):
            for j in range(i + 1):
                P[i, j] = P[j, i] = 0.5 * ((M[i, j] - correction[i, j]) + (M[j, i] - correction[j, i]))
        if change <= _SETTLED:
            return gain, iteration + 1
    return gain, _MOST_ITERATIONS


@njit_in_flight(error_model="numpy")
def estimate_step(
    data: Any,
    state: np.ndarray,
    step: int,
    measurement: np.ndarray,
    command: np.ndarray,
    work: np.ndarray,
    estimate: np.ndarray,
) -> None:
    """Write into ``estimate`` (9) the state that a ``measurement`` (9) of ``step`` and all before it speak for.

    Args:
        data: :class:`EstimatorData`.
        state: Estimate and offsets (11) of the step before, replaced; step 0 begins it.
        step: k.
        measurement: y.
        command: u of the step before (2); step 0 does not need it.
        work: Scratch, see :func:`scratch`.
        estimate: Written.
    """
    if step == 0:
        for i in range(N_STATES):
            estimate[i] = data.start[i]
        for i in range(N_INPUTS):
            state[N_STATES + i] = 0.0
    else:
        held = work[3]
        for i in range(N_STATES):
            estimate[i] = state[i]
        for i in range(N_INPUTS):
            held[i] = command[i] + state[N_STATES + i]
        advance(estimate, held, data.vehicle, data.period, data.substeps, work)
    for i in range(N_STATES):
        state[i] = estimate[i]
    for i in range(N_ESTIMATED):
        for j in range(N_RIGID):
            state[i] += data.gain[i, j] * (measurement[j] - estimate[j])
    for i in range(N_STATES):
        estimate[i] = state[i]


class Estimator:
    """The estimator of a flight, step by step."""

    PARAMETERS = (
        *ESTIMATOR_PARAMETERS,
        *INITIAL_PARAMETERS,
        *(p for p in SENSOR_PARAMETERS if p.name in _SENSED),
        *VEHICLE_PARAMETERS,
    )

    def __init__(self, data: EstimatorData) -> None:
        self.data = data
        self._state = np.zeros(N_ESTIMATED)
        self._work = scratch()
        self.step(1, data.start, np.zeros(N_INPUTS))  # compile now: a cold cache must not stall a flight

    @classmethod
    def from_parameters(cls, values: Mapping[str, object], period: float) -> Self:
        """Build from :attr:`PARAMETERS` for a control ``period`` (s).

        Raises:
            ParameterError, DesignError, TrimError: As :func:`estimator_data`, or a wrong value, named.
        """
        nominal, start = initial_trim(values)
        sensed = sensor_data({name: values[name] for name in _SENSED if name in values}, period)
        return cls(estimator_data(values, sensed.noise, nominal, start, period))

    def step(self, step: int, measurement: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return the estimate (9) of the state in ``step``; see :func:`estimate_step`."""
        estimate = np.empty(N_STATES)
        estimate_step(self.data, self._state, step, measurement, command, self._work, estimate)
        return estimate
