"""Models of hardware and air that a scenario declares or that options of the command line describe.

Noise counts :data:`REACH` standard deviations, which one normal number in 370 exceeds; :data:`LARGEST_REACH` bounds
them all. An effect without a known bound is named, and with it nothing is certified.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hsv.base.errors import DesignError, QuantityError
from hsv.base.units import parse_quantity
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.core.arithmetic import LARGEST
from hsv.design.certified import CertifiedDesign
from hsv.design.hardware.effects import Measured, Model, air, unexplained
from hsv.design.hardware.plan import Plan
from hsv.flight.scenario import Scenario
from hsv.model.actuators import ACTUATOR_PARAMETERS, IDEAL
from hsv.model.atmosphere import atmosphere_data
from hsv.model.links import command_link, computation, measurement_link
from hsv.model.sensors import SENSOR_SETS, SensorData, sensor_data
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES, STATE_UNITS

REACH = 3.0
"""Standard deviations of noise and turbulence that count as their bound: one sample in 370 is beyond."""

LARGEST_REACH = float(np.ceil(1e3 * LARGEST)) / 1e3
"""Bound of all normal numbers, rounded up to three decimals."""


def sensors(data: SensorData, plan: Plan, reach: float = REACH, of: str = "sensor") -> dict[str, Model]:
    """Return the sensor models of the rigid states by name; ideal ones are omitted.

    Noise and a Gauss-Markov bias count ``reach`` standard deviations, and so do biases and scales that are drawn once a
    flight; a quantum counts half; what is late is so exactly.
    """
    rigid = slice(0, N_RIGID)
    scale = (np.abs(data.scale) + reach * data.scale_sigma)[rigid]
    errors = {
        f"{of} noise": reach * np.hypot(data.noise, data.drift_sigma)[rigid],
        f"{of} bias": (np.abs(data.bias) + reach * data.bias_sigma)[rigid] + scale * plan.largest(),
        f"{of} quantisation": 0.5 * data.quantum[rigid],
    }
    inertial = bool(data.inertial_angle_of_attack)
    models: dict[str, Model] = {
        name: Measured(error, inertial=inertial, plan=plan) for name, error in errors.items() if error.any()
    }
    if data.latency[rigid].any():
        models[f"{of} latency"] = Measured(np.zeros(N_RIGID), data.latency[rigid], plan=plan)
    return models


def without_bound(data: SensorData, values: Mapping[str, Any]) -> list[str]:
    """Return the effects of sensors of the rigid states, and of an estimator, for which no bound is known."""
    found = {
        "lag of a sensor": data.lag_decay[:N_RIGID].any(),
        "random walk of a sensor": data.walk[:N_RIGID].any(),
        "drop-out of a sensor": data.drop_out[:N_RIGID].any(),
        "range of a sensor": np.isfinite(np.r_[data.minimum[:N_RIGID], data.maximum[:N_RIGID]]).any(),
        "estimator": values.get(ESTIMATOR_ENABLED.name, False),
    }
    return [name for name, there in found.items() if there]


def declared(subject: CertifiedDesign, scenario: Scenario, reach: float = REACH) -> tuple[dict[str, Model], list[str]]:
    """Return the models of sensors and air that a scenario declares, by name, and its effects without a bound.

    Args:
        subject: The design.
        scenario: Its actuators are for :func:`hsv.design.hardware.verdict.certified_with`.
        reach: Standard deviations that count as the bound of what is normally distributed.
    """
    values, design = scenario.parameters(), subject.design
    data, moving = sensor_data(values, design.period), atmosphere_data(values, design.period)
    plan = Plan.of(subject)
    models, unbounded = sensors(data, plan, reach), without_bound(data, values)
    if models:
        equipment = {name: value for name, value in values.items() if name.startswith("sensors.") or name == "seed"}
        _remeasure(models, unbounded, plan, equipment)
    vehicle, gusts = subject.vehicle, np.abs(moving.gust).sum(axis=0)
    shear = abs(moving.shear) * max(abs(h - moving.shear_altitude) for h in vehicle.altitude_range)
    winds = {
        "wind": np.abs(moving.wind) + np.array([shear, 0.0]),
        "gusts": gusts if len(moving.gust) else np.zeros(2),
        "turbulence": reach * moving.sigma,
    }
    for name, (forward, up) in winds.items():
        if forward or up:
            models[name] = air(vehicle, design.period, forward, up)
    if density := abs(moving.density_offset) + reach * moving.density_sigma:
        models["density"] = air(vehicle, design.period, density=density)
    return models, [*unbounded, *_beside(values, design.period)]


def _beside(values: Mapping[str, Any], period: float) -> list[str]:
    """Return the names of links that are not ideal and of changed actuator parameters, which have no model here."""
    own = [p.name for p in ACTUATOR_PARAMETERS if isinstance(p.default, list) and values.get(p.name)]
    late = not command_link(values, period).ideal or computation(values, period)[1] > 0.0
    found = {"link of the measurement": not measurement_link(values).ideal, "link of the command": late}
    return [*own, *(name for name, there in found.items() if there)]


def _remeasure(models: dict[str, Model], unbounded: list[str], plan: Plan, equipment: Mapping[str, Any]) -> None:
    """Add the model errors measured in flights with sensors; if a flight fails, they are an unbounded effect."""
    try:
        models["model errors under sensors"] = unexplained(plan, equipment)
    except DesignError as failure:
        unbounded.append(f"sensors ({failure})")


def declared_actuators(scenario: Scenario) -> str:
    """Return the published actuators that a scenario flies, separated by commas, or that they are ideal."""
    sets = [scenario.equipment.get(f"actuator.{channel}.set", IDEAL) for channel in INPUT_NAMES]
    return ",".join(name for name in sets if name != IDEAL) or IDEAL


def described(
    subject: CertifiedDesign,
    *,
    sensor_set: str = "ideal",
    bias: Sequence[str] = (),
    gust: str = "0 ft/s",
    turbulence: str = "0 ft/s",
    density: str = "0 %",
    reach: float = REACH,
) -> tuple[dict[str, Model], list[str]]:
    """Return the models that options describe, by name, and the effects without a bound; none of size zero.

    Args:
        subject: The design.
        sensor_set: A published set.
        bias: Texts "state=quantity" of constant biases of rigid states.
        gust: Largest wind, from below and from behind.
        turbulence: Standard deviation, both ways.
        density: Largest relative difference.
        reach: Standard deviations that count as the bound of what is normally distributed.

    Raises:
        QuantityError: A value that cannot be read or is below zero, or a name that is unknown.
    """
    if sensor_set not in SENSOR_SETS:
        raise QuantityError(f"sensors = {sensor_set!r}: expected one of {', '.join(SENSOR_SETS)}")
    if not 0.0 < reach <= LARGEST_REACH:
        raise QuantityError(f"reach = {reach:g}: expected more than 0, up to {LARGEST_REACH}, beyond which no noise is")
    names = STATE_NAMES[:N_RIGID]
    biases = np.zeros(N_RIGID)
    for text in bias:
        name, _, value = text.partition("=")
        if name.strip() not in names:
            raise QuantityError(f"bias = {text!r}: expected one of {', '.join(names)}, then = and a quantity")
        index = names.index(name.strip())
        biases[index] = abs(parse_quantity(value.strip(), STATE_UNITS[index], f"bias {names[index]}"))
    sizes = {
        "gust": parse_quantity(gust, "m/s", "gust"),
        "turbulence": parse_quantity(turbulence, "m/s", "turbulence"),
        "density": parse_quantity(density, "1", "density"),
    }
    for name, size in sizes.items():
        if size < 0.0:
            raise QuantityError(f"{name} = {size:g}: expected zero or more")
    vehicle, period = subject.vehicle, subject.design.period
    models: dict[str, Model] = {}
    unbounded: list[str] = []
    if sensor_set != "ideal" or biases.any():
        plan, data = Plan.of(subject), sensor_data({"sensors.set": sensor_set}, period)
        models |= sensors(data, plan, reach, f"{sensor_set} sensors:")
        if biases.any():
            models[f"bias of {', '.join(text.strip() for text in bias)}"] = Measured(biases, plan=plan)
        given = {f"sensors.{n}.bias": [float(b)] for n, b in zip(names, biases, strict=True) if b}
        _remeasure(models, unbounded, plan, {"sensors.set": sensor_set, **given})
    if sizes["gust"]:
        models[f"gust {gust}"] = air(vehicle, period, sizes["gust"], sizes["gust"])
    if sizes["turbulence"]:
        bound = reach * sizes["turbulence"]
        models[f"turbulence {turbulence}"] = air(vehicle, period, bound, bound)
    if sizes["density"]:
        models[f"density {density}"] = air(vehicle, period, density=sizes["density"])
    return models, unbounded
