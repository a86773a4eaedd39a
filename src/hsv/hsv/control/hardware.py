"""List the hardware of a flight that the certificate of its design does not cover.

Here and not with the rest of the coverage, because the tube law needs it in flight.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hsv.base.parameters import one_or, validate
from hsv.base.units import UnitSystem, in_system
from hsv.control.design import ControlDesign
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.model.actuators import ACTUATOR_PARAMETERS, ACTUATOR_SETS, IDEAL
from hsv.model.atmosphere import ATMOSPHERE_PARAMETERS, atmosphere_data
from hsv.model.links import COMMAND_LINK_PARAMETERS, COMPUTATION_PARAMETER, MEASUREMENT_LINK_PARAMETERS
from hsv.model.sensors import FIELDS, SENSOR_PARAMETERS, sensor_data
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES

HARDWARE_PARAMETERS = (
    *ACTUATOR_PARAMETERS,
    *ATMOSPHERE_PARAMETERS,
    *SENSOR_PARAMETERS,
    *MEASUREMENT_LINK_PARAMETERS,
    *COMMAND_LINK_PARAMETERS,
    COMPUTATION_PARAMETER,
    ESTIMATOR_ENABLED,
)
"""Parameters of the hardware of a flight: actuators, air, sensors, links and estimator."""

_CERTIFIED = {
    **dict.fromkeys(("actuator", "sensors", "link"), "an ideal one"),
    **dict.fromkeys(("wind", "turbulence", "gust"), "still air"),
    "density": "the model's density",
    "estimator": "a loop without one",
}
"""Hardware for which a certificate holds, in words, by the first part of the parameter's name."""

_SHAPING = (
    *("drift_time", "burst", "checksum"),
    *("shear_altitude", "length", "length_forward", "length_up", "lengths", "stays", "starts"),
)
"""Last parts of the names of parameters that have no effect without another one of their table."""


def uncovered_hardware(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return a message for each hardware parameter in ``values`` that the certificate of ``design`` does not cover."""
    v = validate(HARDWARE_PARAMETERS, values)
    sets = {f"actuator.{ACTUATOR_SETS[name].channel}.set": name for name in design.actuators}
    standards = {f"sensors.{channel}.{field.name}": field.standard for channel in STATE_NAMES for field in FIELDS}
    ideal = [table for table in ("wind", "turbulence", "gust", "density") if atmosphere_data(v, design.period).still]
    ideal += ["sensors"] if sensor_data(v, design.period).ideal else []
    found = []
    for parameter in HARDWARE_PARAMETERS:
        table, name = parameter.name.partition(".")[0], parameter.name.rpartition(".")[2]
        given, certified = v[parameter.name], _CERTIFIED[table]
        if isinstance(given, str):
            covered, shown = given == sets.get(parameter.name, IDEAL), given
            certified = sets.get(parameter.name, certified)
        else:
            numbers = given if isinstance(given, list) else [given]
            covered = all(number == standards.get(parameter.name, 0.0) for number in numbers)
            shown = "" if covered else _written(max(numbers, key=abs), parameter.unit, name)
        # A stop is judged below: it matters only if it is narrower than the largest command.
        if not covered and table not in ideal and name not in (*_SHAPING, "stop"):
            found.append(f"{parameter.name}: {shown}; the certificate is for {certified}")
    for channel, unit, reach in zip(INPUT_NAMES, INPUT_UNITS, commanded(design), strict=True):
        chosen = ACTUATOR_SETS.get(v[f"actuator.{channel}.set"])
        name = f"actuator.{channel}.stop"
        stop = one_or(name, v[name], chosen.stop if chosen else np.inf)
        if stop < reach:
            largest = _written(reach, unit)
            found.append(
                f"actuator.{channel}.stop: {_written(stop, unit)}; the certificate lets commands go to {largest}"
            )
    return found


def commanded(design: ControlDesign) -> np.ndarray:
    """Return the largest |u|, shape (2,): of certified plans plus feedback or, without plan bounds, of the limits."""
    bounds = design.plan_bounds
    if bounds is None:
        return np.maximum(np.abs(design.input_minimum), np.abs(design.input_maximum))
    lowest = bounds.region_minimum[:2] - (bounds.input_minimum - design.input_minimum)
    highest = bounds.region_maximum[:2] + (design.input_maximum - bounds.input_maximum)
    return np.maximum(np.abs(lowest), np.abs(highest))


def _written(value: float, unit: str, name: str = "") -> str:
    # Angles are shown in degrees, but natural frequencies in rad/s.
    system = UnitSystem.si if name in ("natural_frequency", "lag") else UnitSystem.paper
    number, shown = in_system(value, unit or "1", system)
    return f"{number:.4g}" + ("" if shown == "1" else f" {shown}")
