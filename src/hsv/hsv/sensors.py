"""Sensors: from the state to what is measured of it, channel by channel, compiled.

A measurement is y = fault(clip(quantise(hold(delay(lag((1 + s) x) + b + n))))): scale factor and lag of the sensor,
bias and noise, latency of whole samples, samples that are lost and held, quantisation, range, and at last what fails. A
channel that is ideal passes to the bit, unless it fails. In step 0 lags rest and delays are full of the first sample.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.elementary import exponential
from hsv.errors import ParameterError
from hsv.faults.laws import ACTING, CHANNEL, CODE, KEPT, ONSET, PARAMETER, START, begin_faults
from hsv.faults.table import (
    SENSOR_BIAS,
    SENSOR_DROP_OUT,
    SENSOR_FREEZE,
    SENSOR_NOISE,
    SENSOR_RUNAWAY,
    SENSOR_SCALE,
)
from hsv.noise import STREAMS, normals, uniforms
from hsv.parameters import Parameter, check_all
from hsv.units import readable
from hsv.vehicle.dynamics import N_STATES, STATE_NAMES, STATE_UNITS
from hsv.vehicle.envelope import FOOT

LONGEST_LATENCY = 50
"""Steps."""

ALPHA, PITCH = STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")


class Field(NamedTuple):
    """A property of a sensor; ``{}`` in its unit is the unit of the channel, ``standard`` that of an ideal sensor."""

    name: str
    description: str
    unit: str
    minimum: float
    maximum: float
    standard: float
    whole: bool = False


FIELDS = (
    Field("noise", "standard deviation of white noise", "{}", 0.0, 1e6, 0.0),
    Field("bias", "constant bias", "{}", -1e6, 1e6, 0.0),
    Field("bias_sigma", "standard deviation of a bias drawn once per flight", "{}", 0.0, 1e6, 0.0),
    Field("drift_sigma", "standard deviation of a Gauss-Markov bias", "{}", 0.0, 1e6, 0.0),
    Field("drift_time", "correlation time of the Gauss-Markov bias", "s", 1e-3, 1e9, 1.0),
    Field("random_walk", "random walk, after one second", "{}/s^0.5", 0.0, 1e6, 0.0),
    Field("scale", "relative error of the scale", "", -0.9, 10.0, 0.0),
    Field("scale_sigma", "standard deviation of a scale error drawn once per flight", "", 0.0, 1.0, 0.0),
    Field("lag", "bandwidth of a first-order lag; 0: none", "rad/s", 0.0, 1e4, 0.0),
    Field("latency", "age of a sample, control periods", "", 0.0, float(LONGEST_LATENCY), 0.0, whole=True),
    Field("drop_out", "probability that a sample is lost", "", 0.0, 1.0, 0.0),
    Field("quantum", "step of the quantisation; 0: none", "{}", 0.0, 1e6, 0.0),
    Field("minimum", "least measurement; none unless given", "{}", -1e6, 1e6, -math.inf),
    Field("maximum", "largest measurement; none unless given", "{}", -1e6, 1e6, math.inf),
)


@dataclass(frozen=True)
class SensorSet:
    """Published sensors: fields of the channels that are not ideal, SI and radians, and their source."""

    channels: Mapping[str, Mapping[str, float]]
    source: str
    inertial_angle_of_attack: bool = False
    """Whether the angle of attack is the pitch angle less an inertial path angle, with the error of the former"""


_FINE_ANGLE = math.radians(0.005)

SENSOR_SETS = {
    "ideal": SensorSet({}, "the paper's"),
    "fine": SensorSet(
        {
            "altitude": {"noise": FOOT},
            "velocity": {"noise": 0.1 * FOOT},
            "angle_of_attack": {"noise": _FINE_ANGLE},
            "pitch_angle": {"noise": _FINE_ANGLE},
            "pitch_rate": {"noise": math.radians(0.01)},
        },
        "what this design's feedback turns into half a degree rms of elevator; a tactical-grade gyro has 0.015 deg/s",
    ),
    "ghv": SensorSet(
        {
            "altitude": {"noise": float(np.sqrt(10.0)) * FOOT},
            "velocity": {"noise": FOOT},
            "angle_of_attack": {"noise": 1e-3},
            "pitch_angle": {"noise": 1e-3},
            "pitch_rate": {"noise": float(np.sqrt(1e-5))},
        },
        "Wiese, generic hypersonic vehicle, MIT thesis 2013: white noise of the research model",
    ),
    "inertial": SensorSet(
        {
            "altitude": {"drift_sigma": 0.84, "drift_time": 500.0, "noise": 0.25},
            "velocity": {"noise": 0.03},
            "pitch_angle": {"bias_sigma": 1e-4, "noise": 5e-5},
            "pitch_rate": {"bias_sigma": 1e-6, "scale_sigma": 2e-5},
        },
        "Zipfel, GHAME hypersonic vehicle, CADAC GHAME6: satellite navigation, star tracker, inertial unit",
        inertial_angle_of_attack=True,
    ),
}
"""Sensor sets that a scenario can name."""


def _unit(pattern: str, unit: str) -> str:
    return pattern.replace("{}", unit) if "{}" in pattern else pattern


SENSOR_PARAMETERS = (
    Parameter("sensors.set", "ideal", "published sensors", choices=tuple(SENSOR_SETS)),
    Parameter(
        "sensors.inertial_angle_of_attack", [], "1: with the error of the pitch angle, too", "", 0.0, 1.0, whole=True
    ),
    *(
        Parameter(f"sensors.{c}.{f.name}", [], f.description, _unit(f.unit, unit), f.minimum, f.maximum, whole=f.whole)
        for c, unit in zip(STATE_NAMES, STATE_UNITS, strict=True)
        for f in FIELDS
    ),
)
"""Empty: as the set has it."""

LAGGED, DRIFT, WALK, BIAS, SCALE, HELD, GIVEN, QUEUE = range(8)
"""Columns of the state: the lagged signal; the Gauss-Markov bias and the random walk; bias and scale that were drawn;
the last sample that was not lost; the last measurement; from the last one on, samples on their way."""

SENSOR_STATE = QUEUE + LONGEST_LATENCY + 1
"""Numbers in the state of a channel."""

_NOISE, _CONSTANTS, _DROP_OUT = STREAMS["sensor_noise"], STREAMS["sensor_constants"], STREAMS["sensor_drop_out"]
_FAULT_NOISE, _FAULT_DROP_OUT = STREAMS["sensor_fault_noise"], STREAMS["sensor_fault_drop_out"]


class SensorData(NamedTuple):
    """Sensors for compiled functions, an entry a state (9); ``on`` where a sensor is not ideal.

    Lag and drift as shares that remain over a period, the random walk per root of a period.
    """

    on: np.ndarray
    noise: np.ndarray
    bias: np.ndarray
    bias_sigma: np.ndarray
    drift_sigma: np.ndarray
    drift_decay: np.ndarray
    walk: np.ndarray
    scale: np.ndarray
    scale_sigma: np.ndarray
    lag_decay: np.ndarray
    latency: np.ndarray
    drop_out: np.ndarray
    quantum: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray
    inertial_angle_of_attack: bool
    ideal: bool


def sensor_data(values: Mapping[str, object], period: float) -> SensorData:
    """Return the sensors that :data:`SENSOR_PARAMETERS` describe, read every ``period`` (s).

    Raises:
        ParameterError: A wrong value, named.
    """
    v = check_all(SENSOR_PARAMETERS, values)
    chosen = SENSOR_SETS[v["sensors.set"]]
    table = {field.name: np.full(N_STATES, field.standard) for field in FIELDS}
    for i, channel in enumerate(STATE_NAMES):
        for field in FIELDS:
            name = f"sensors.{channel}.{field.name}"
            standard = chosen.channels.get(channel, {}).get(field.name, field.standard)
            table[field.name][i] = _one(name, v[name], standard)
    for channel, unit, low, high in zip(STATE_NAMES, STATE_UNITS, table["minimum"], table["maximum"], strict=True):
        if not low < high:
            raise ParameterError(
                f"parameter sensors.{channel}.minimum = {readable(low, unit)}: "
                f"expected less than maximum, {readable(high, unit)}"
            )
    inertial = _one(
        "sensors.inertial_angle_of_attack",
        v["sensors.inertial_angle_of_attack"],
        float(chosen.inertial_angle_of_attack),
    )
    on = np.zeros(N_STATES, np.bool_)
    for field in FIELDS:
        if field.name != "drift_time":
            on |= table[field.name] != field.standard
    if inertial:
        on[ALPHA] |= on[PITCH]
    return SensorData(
        on,
        table["noise"],
        table["bias"],
        table["bias_sigma"],
        table["drift_sigma"],
        np.array([exponential(-period / time) if period < 700.0 * time else 0.0 for time in table["drift_time"]]),
        table["random_walk"] * np.sqrt(period),
        table["scale"],
        table["scale_sigma"],
        np.array([exponential(-frequency * period) if frequency > 0.0 else 0.0 for frequency in table["lag"]]),
        table["latency"].astype(np.int64),
        table["drop_out"],
        table["quantum"],
        table["minimum"],
        table["maximum"],
        bool(inertial),
        not on.any(),
    )


def _one(name: str, given: list[float], standard: float) -> float:
    if len(given) > 1:
        raise ParameterError(f"parameter {name}: {len(given)} values, expected one, or none for the set's")
    return float(given[0]) if given else standard


def sensor_state() -> np.ndarray:
    """Return room for the state (9, :data:`SENSOR_STATE`) of the sensors, which step 0 fills."""
    return np.zeros((N_STATES, SENSOR_STATE))


@njit_in_flight(error_model="numpy")
def measure(
    data: Any,
    state: np.ndarray,
    rows: Any,
    memory: np.ndarray,
    step: int,
    seed: int,
    x: np.ndarray,
    measurement: np.ndarray,
) -> None:
    """Write into ``measurement`` (9) the output of the sensors for the state ``x`` (9) in ``step``.

    Args:
        data: :class:`SensorData`.
        state: See :func:`sensor_state`, replaced.
        rows: Faults of sensors, see :mod:`hsv.faults.laws`.
        memory: Theirs, replaced.
        step: k; steps follow one another from 0 on.
        seed: Seed of the flight.
        x: The truth.
        measurement: Written.
    """
    failing = begin_faults(rows, memory, step, seed)
    pitch_error = 0.0
    for back in range(N_STATES):
        i = N_STATES - 1 - back  # the error of the pitch angle is known before the angle of attack's
        if data.on[i]:
            error = _error(data, state, i, step, seed)
            if i == PITCH:
                pitch_error = error
            elif i == ALPHA and data.inertial_angle_of_attack:
                error += pitch_error
            measurement[i] = _sampled(data, state, i, step, seed, x[i], error)
        else:
            measurement[i] = x[i]
    if failing > 0:
        for j in range(len(rows.table)):
            if memory[j, ACTING] == 1.0:
                i = int(rows.table[j, CHANNEL])
                measurement[i] = _failed(rows, memory, j, step, seed, measurement[i], state[i, GIVEN])
    for i in range(N_STATES):
        state[i, GIVEN] = measurement[i]


@njit_in_flight(error_model="numpy", inline="always")
def _error(data: Any, state: np.ndarray, i: int, step: int, seed: int) -> float:
    """Return bias and noise of a step; draw what is drawn once in step 0."""
    if step == 0:
        first, second = normals(seed, 0, _CONSTANTS + i)
        state[i, BIAS] = data.bias[i] + data.bias_sigma[i] * first
        state[i, SCALE] = data.scale[i] + data.scale_sigma[i] * second
        state[i, WALK] = 0.0
    error = state[i, BIAS]
    if data.noise[i] > 0.0 or data.drift_sigma[i] > 0.0:
        white, driving = normals(seed, step, _NOISE + i)
        error += data.noise[i] * white
        if data.drift_sigma[i] > 0.0:
            decay = data.drift_decay[i]
            if step == 0:
                state[i, DRIFT] = data.drift_sigma[i] * driving
            else:
                share = np.sqrt(max(1.0 - decay * decay, 0.0))
                state[i, DRIFT] = decay * state[i, DRIFT] + data.drift_sigma[i] * share * driving
            error += state[i, DRIFT]
    if data.walk[i] > 0.0 and step > 0:
        driving, _ = normals(seed, step, _NOISE + i, 1)
        state[i, WALK] += data.walk[i] * driving
    return error + state[i, WALK]


@njit_in_flight(error_model="numpy", inline="always")
def _sampled(data: Any, state: np.ndarray, i: int, step: int, seed: int, x: float, error: float) -> float:
    """Return the measurement of a sensor that works."""
    true = (1.0 + state[i, SCALE]) * x
    state[i, LAGGED] = true if step == 0 else true + data.lag_decay[i] * (state[i, LAGGED] - true)
    value = state[i, LAGGED] + error
    if data.latency[i] > 0:
        size = data.latency[i] + 1
        if step == 0:
            for j in range(size):
                state[i, QUEUE + j] = value
        state[i, QUEUE + step % size] = value
        value = state[i, QUEUE + (step + 1) % size]
    if data.drop_out[i] > 0.0 and step > 0:
        drawn, _ = uniforms(seed, step, _DROP_OUT + i)
        if drawn < data.drop_out[i]:
            return state[i, HELD]
    if data.quantum[i] > 0.0:
        value = data.quantum[i] * float(math.floor(value / data.quantum[i] + 0.5))
    state[i, HELD] = min(max(value, data.minimum[i]), data.maximum[i])
    return state[i, HELD]


@njit_in_flight(error_model="numpy", inline="always")
def _failed(rows: Any, memory: np.ndarray, j: int, step: int, seed: int, value: float, given: float) -> float:
    """Return what becomes of a measurement; ``given`` is the one of the step before."""
    code, first = int(rows.table[j, CODE]), rows.table[j, PARAMETER]
    fresh = memory[j, ONSET] == step
    if code == SENSOR_SCALE:
        return first * value
    if code == SENSOR_NOISE:
        drawn, _ = normals(seed, step, _FAULT_NOISE + int(rows.table[j, CHANNEL]), rows.table[j, START])
        return value + first * drawn
    if code == SENSOR_BIAS:
        return value + first
    if code == SENSOR_RUNAWAY:
        limit = rows.table[j, PARAMETER + 1]
        return value + min(max(first * ((step - rows.table[j, START]) * rows.period), -limit), limit)
    if code == SENSOR_DROP_OUT:
        if fresh:
            memory[j, KEPT] = given if step > 0 else value
        drawn, _ = uniforms(seed, step, _FAULT_DROP_OUT + int(rows.table[j, CHANNEL]), rows.table[j, START])
        if drawn >= first:
            memory[j, KEPT] = value
        return memory[j, KEPT]
    if code == SENSOR_FREEZE:
        if fresh:
            memory[j, KEPT] = value
        return memory[j, KEPT]
    return value
