"""Actuators of the vehicle: published sets, their parameters, and the data with which ``core/actuators.h`` moves them.

An ideal actuator reaches its command at once. The vehicle receives the command itself, limited by the stops, while all
actuators are ideal, no command arrives later than at the start of its period, and no fault of an actuator or effector
acts. Otherwise actuators and vehicle are advanced by substeps, at most a quarter of the control period long; over a
substep, an effector is held at its mean position.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, one_or, validate
from hsv.core import Struct, doubles, lib
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS

SUBSTEPS = lib.ACTUATOR_SUBSTEPS
"""Number of substeps of a control period if an actuator is not ideal."""


@dataclass(frozen=True)
class ActuatorSet:
    """A published actuator, SI and radians; an infinite limit means no limit."""

    channel: str
    order: int
    """Order of the dynamics, 1 or 2; 0 for an ideal actuator"""
    natural_frequency: float
    """rad/s; the inverse of the time constant if the order is 1"""
    damping_ratio: float
    stop: float
    """Largest magnitude of the position; the vehicle's own limits hold as well"""
    rate_limit: float
    source: str


IDEAL = "ideal"

FUEL, ELEVATOR = INPUT_NAMES

ACTUATOR_SETS = {
    name: ActuatorSet(channel, order, frequency, damping, math.radians(stop), math.radians(rate), source)
    for name, channel, order, frequency, damping, stop, rate, source in (
        ("elevator_50", ELEVATOR, 2, 50.0, 0.7, 20.0, 400.0, "Zipfel, GHAME hypersonic vehicle, CADAC GHAME6"),
        ("elevator_150", ELEVATOR, 2, 150.0, 0.7, 30.0, 100.0, "Wiese, generic hypersonic vehicle, MIT thesis 2013"),
        ("elevator_20", ELEVATOR, 2, 20.0, 0.7, 30.0, inf, "NASA, Generic Urban Air Mobility simulation"),
        ("elevator_first_order_20", ELEVATOR, 1, 20.0, 1.0, inf, inf, "scramjet vehicle trade studies, AIAA 2009-7287"),
        ("fuel_10", FUEL, 1, 10.0, 1.0, inf, inf, "Wiese, generic hypersonic vehicle, MIT thesis 2013: fuel delivery"),
    )
}
"""Actuators that a scenario can name; the rows above have stops in deg and rate limits in deg/s."""


def _parameters() -> tuple[Parameter, ...]:
    table = []
    for channel, unit in zip(INPUT_NAMES, ("", *INPUT_UNITS[1:]), strict=True):
        names = tuple(name for name, entry in ACTUATOR_SETS.items() if entry.channel == channel)
        where = f"actuator.{channel}"
        per_second = f"{unit or '1'}/s"
        table += [
            Parameter(f"{where}.set", IDEAL, "published actuator of this channel", choices=(IDEAL, *names)),
            Parameter(
                f"{where}.order", [], "order of the dynamics, 0 ideal, instead of the set's", "", 0.0, 2.0, whole=True
            ),
            Parameter(f"{where}.natural_frequency", [], "instead of the set's", "rad/s", 0.1, 1e4),
            Parameter(f"{where}.damping_ratio", [], "instead of the set's", "", 0.05, 1.0),
            Parameter(f"{where}.stop", [], "largest magnitude, instead of the set's", unit, 0.0, 1e3),
            Parameter(f"{where}.rate_limit", [], "largest rate, instead of the set's", per_second, 1e-6, 1e6),
            Parameter(f"{where}.acceleration_limit", [], "of order 2; none unless given", f"{per_second}^2", 1e-6),
        ]
    return tuple(table)


ACTUATOR_PARAMETERS = _parameters()
"""Parameters of the actuators; an empty array stands for the value in the chosen set."""


def actuator_data(values: Mapping[str, object], vehicle: VehicleParameters, period: float) -> Struct:
    """Return a ``vehicle``'s actuators from values of :data:`ACTUATOR_PARAMETERS`, for a control ``period`` (s)."""
    v = validate(ACTUATOR_PARAMETERS, values)
    h = period / SUBSTEPS
    order, map = np.zeros(N_INPUTS, np.int64), np.zeros((N_INPUTS, 4))
    frequency, damping, rate, acceleration = (np.full(N_INPUTS, np.inf) for _ in range(4))
    low, high = vehicle.input_minimum, vehicle.input_maximum
    for i, channel in enumerate(INPUT_NAMES):
        where = f"actuator.{channel}"
        name = v[f"{where}.set"]
        base = ACTUATOR_SETS.get(name, ActuatorSet(channel, 0, inf, 1.0, inf, inf, ""))
        given = {
            field: one_or(f"{where}.{field}", v[f"{where}.{field}"], standard)
            for field, standard in (
                ("order", float(base.order)),
                ("natural_frequency", base.natural_frequency),
                ("damping_ratio", base.damping_ratio),
                ("stop", base.stop),
                ("rate_limit", base.rate_limit),
                ("acceleration_limit", inf),
            )
        }
        order[i] = int(given["order"])
        frequency[i], damping[i] = given["natural_frequency"], given["damping_ratio"]
        rate[i], acceleration[i] = given["rate_limit"], given["acceleration_limit"]
        low[i], high[i] = max(low[i], -given["stop"]), min(high[i], given["stop"])
        if order[i] > 0:
            if not math.isfinite(frequency[i]):
                raise ParameterError(
                    f"parameter {where}.natural_frequency: none given, expected one for an order of {order[i]}"
                )
            lib.hsv_actuator_map(order[i], frequency[i], damping[i], h, doubles(map[i]))
        elif math.isfinite(frequency[i]):
            raise ParameterError(f"parameter {where}.order: 0, expected 1 or 2 with a natural frequency")
        for field in ("damping_ratio", "acceleration_limit"):
            if order[i] < 2 and v[f"{where}.{field}"]:
                raise ParameterError(f"parameter {where}.{field}: expected none for an order of {order[i]}")
    stops = np.array_equal(low, vehicle.input_minimum) and np.array_equal(high, vehicle.input_maximum)
    ideal = not order.any() and stops and not np.isfinite(rate).any()
    return Struct(
        "hsv_actuators",
        order=order,
        natural_frequency=frequency,
        damping_ratio=damping,
        map=map,
        minimum=low,
        maximum=high,
        rate_limit=rate,
        acceleration_limit=acceleration,
        substep=h,
        ideal=bool(ideal),
    )


def actuators_at_rest(position: np.ndarray) -> np.ndarray:
    """Return the state, one row [position, rate] per input, of actuators at rest at ``position``, shape (2,)."""
    state = np.zeros((N_INPUTS, 2))
    state[:, 0] = position
    return state
