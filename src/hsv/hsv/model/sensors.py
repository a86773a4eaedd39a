"""Sensors, which measure the state x channel by channel; see ``core/sensors.h``.

A measurement is y = fault(clip(quantise(hold(delay(lag((1 + s) x) + b + n))))) with scale error s, bias b and noise n:
lag of the sensor, latency in samples, hold of lost samples, quantisation, range and faults act in this order. An ideal
channel without a fault passes the state unchanged. In step 0 lags are in equilibrium and delays hold the first sample.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, one_or, validate
from hsv.base.units import FOOT, readable
from hsv.core import Struct, dtype, lib
from hsv.core.arithmetic import exponential
from hsv.model.signals import N_STATES, STATE_NAMES, STATE_UNITS

ALPHA, PITCH = STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")


class Field(NamedTuple):
    """A property of a sensor; ``{}`` in its unit stands for the channel's unit, ``standard`` is the ideal value."""

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
    Field("latency", "age of a sample, control periods", "", 0.0, float(lib.MAX_DELAY), 0.0, whole=True),
    Field("drop_out", "probability that a sample is lost", "", 0.0, 1.0, 0.0),
    Field("quantum", "step of the quantisation; 0: none", "{}", 0.0, 1e6, 0.0),
    Field("minimum", "least measurement; none unless given", "{}", -1e6, 1e6, -math.inf),
    Field("maximum", "largest measurement; none unless given", "{}", -1e6, 1e6, math.inf),
)


@dataclass(frozen=True)
class SensorSet:
    """Published sensors: for each channel the properties that are not ideal, in SI units, and the source."""

    channels: Mapping[str, Mapping[str, float]]
    source: str
    inertial_angle_of_attack: bool = False
    """Whether alpha is measured as pitch angle minus inertial path angle, with the error of the pitch angle as well"""


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
"""Parameters of the sensors; an empty array stands for the value in the chosen set."""


def sensor_data(values: Mapping[str, object], period: float) -> Struct:
    """Return the sensors that values of :data:`SENSOR_PARAMETERS` describe, sampled every ``period`` (s)."""
    v = validate(SENSOR_PARAMETERS, values)
    chosen = SENSOR_SETS[v["sensors.set"]]
    table: dict[str, np.ndarray] = {field.name: np.full(N_STATES, field.standard) for field in FIELDS}
    for i, channel in enumerate(STATE_NAMES):
        for field in FIELDS:
            name = f"sensors.{channel}.{field.name}"
            standard = chosen.channels.get(channel, {}).get(field.name, field.standard)
            table[field.name][i] = one_or(name, v[name], standard)
    for channel, unit, low, high in zip(STATE_NAMES, STATE_UNITS, table["minimum"], table["maximum"], strict=True):
        if not low < high:
            raise ParameterError(
                f"parameter sensors.{channel}.minimum = {readable(low, unit)}: "
                f"expected less than maximum, {readable(high, unit)}"
            )
        for given, other in (("drift_time", "drift_sigma"), ("drift_sigma", "drift_time")):
            known = v[f"sensors.{channel}.{other}"] or other in chosen.channels.get(channel, {})
            if v[f"sensors.{channel}.{given}"] and not known:
                raise ParameterError(f"parameter sensors.{channel}.{given}: expected with a {other} only")
    inertial = one_or(
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
    # Lag and drift become the shares that remain after a period, the random walk its standard deviation per period.
    drift_time, walk, lag = (table.pop(name) for name in ("drift_time", "random_walk", "lag"))
    table["latency"] = table["latency"].astype(np.int64)
    return Struct(
        "hsv_sensors",
        **table,
        on=on,
        drift_decay=np.array([exponential(-period / time) if period < 700.0 * time else 0.0 for time in drift_time]),
        walk=walk * np.sqrt(period),
        lag_decay=np.array([exponential(-frequency * period) if frequency > 0.0 else 0.0 for frequency in lag]),
        inertial_angle_of_attack=bool(inertial),
        ideal=not on.any(),
    )


def sensor_state() -> np.ndarray:
    """Return the state of the nine sensors: zeros, which step 0 replaces."""
    return np.zeros(N_STATES, dtype("hsv_sensor_memory"))
