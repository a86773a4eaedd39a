"""List the properties of a flight that its certificate does not cover: vehicle, hardware, air, law and faults.

A certificate holds for a vehicle with its uncertainty, the actuators of the design, ideal sensors and links, still air
of the model's density, and a loss of elevator effectiveness down to the value in the inputs of the design. A flight
outside these limits can succeed, and ``hsv certify`` may extend the certificate to it, but this certificate makes no
statement about it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.parameters import Parameter, validate
from hsv.base.units import UnitSystem, to_paper
from hsv.control.controllers import CONTROLLER_PARAMETERS
from hsv.control.design import ControlDesign
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.control.notch_filter import flown_sections
from hsv.model.actuators import ACTUATOR_PARAMETERS, ACTUATOR_SETS, IDEAL
from hsv.model.atmosphere import ATMOSPHERE_PARAMETERS, atmosphere_data
from hsv.model.faults.table import fault_parameters
from hsv.model.links import COMMAND_LINK_PARAMETERS, COMPUTATION_PARAMETER, MEASUREMENT_LINK_PARAMETERS
from hsv.model.sensors import FIELDS, SENSOR_PARAMETERS, sensor_data
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS
from hsv.model.vehicle import Vehicle

_LINK_PARAMETERS = (*MEASUREMENT_LINK_PARAMETERS, *COMMAND_LINK_PARAMETERS, COMPUTATION_PARAMETER)

HARDWARE_PARAMETERS = (
    *ACTUATOR_PARAMETERS,
    *ATMOSPHERE_PARAMETERS,
    *SENSOR_PARAMETERS,
    *_LINK_PARAMETERS,
    ESTIMATOR_ENABLED,
)
"""Parameters of the hardware of a flight: actuators, air, sensors, links and estimator."""

_LAW = "tube_mpc"
"""Name of the only controller that has a certificate."""

_SENSOR_DATA = {"random_walk": "walk", "lag": "lag_decay"}
"""Sensor fields that the sensor data store in another form: field to name in the data."""

_SENSOR_TIMES = ("drift_time",)
"""Sensor fields that have no effect on their own."""

_LINK_DETAILS = ("burst", "checksum")
"""Parameters of links that have no effect without a loss or a corruption."""

_SHAPING = ("shear_altitude", "length", "length_forward", "length_up", "lengths", "stays", "starts")
"""Parameters of the air that have no effect without a velocity or a density."""


def uncovered_hardware(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return a message for each hardware parameter, or estimator, that the certificate of ``design`` does not cover.

    Raises:
        ParameterError: A wrong value, named.
    """
    v = validate(HARDWARE_PARAMETERS, values)
    found = [*_actuators(v, design), *_sensors(v, design.period), *_links(v), *_air(v, design.period)]
    if v[ESTIMATOR_ENABLED.name]:
        found.append("estimator: the certificate has none in the loop")
    return found


def uncovered_vehicle(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return a message for each property of vehicle and law that the certificate of ``design`` does not cover.

    Raises:
        ParameterError: A wrong value, named.
    """
    found = []
    coupling, digest = values.get("vehicle.coupling", design.coupling), values.get("vehicle.digest", design.vehicle)
    if coupling != design.coupling:
        found.append(f"vehicle.coupling: {coupling}; the certificate is for {design.coupling}")
    if digest != design.vehicle:
        found.append("vehicle: not that of the design")
    bounds = Vehicle.from_parameters(values).uncertainty
    prefix = "vehicle.perturbation."
    for name, value in values.items():
        bound = bounds.get(name.removeprefix(prefix), 0.0)
        if name.startswith(prefix) and abs(value) > bound * (1.0 + 1e-9):
            found.append(f"{name}: {100 * value:g} %; the certificate is for {100 * bound:g} % at most")
    if values.get("notch.enabled") is False:
        found.append("notch: none; the invariant set has the design's filter in the loop")
    elif flown_sections(values) != design.notch:
        found.append("notch: not that of the design, which the invariant set has in the loop")
    if values.get("integral.rate", 0.0) > 0.0:
        found.append("integral: action on states that the invariant set does not have")
    if values.get("effectiveness.enabled", False):
        found.append("effectiveness: an estimate by which the elevator command is divided; the certificate has none")
    return found


def uncovered_faults(faults: Iterable[tuple[str, str, Mapping[str, float]]], effectiveness: float | None) -> list[str]:
    """Return a message for each fault that the certificate does not cover.

    Args:
        faults: Channel, type and parameters (SI) of each fault.
        effectiveness: Smallest certified elevator effectiveness, or ``None`` if it is not known.
    """
    found = []
    for channel, kind, parameters in dict.fromkeys((c, k, tuple(p.items())) for c, k, p in faults):
        least = dict(parameters).get("effectiveness", 1.0)
        if (channel, kind) != (INPUT_NAMES[1], "loss_of_effectiveness"):
            why = "a loss of elevator effectiveness alone"
        elif effectiveness is None:
            why = "a loss whose size no available certificate states"
        elif least < effectiveness:
            why = f"a loss to {effectiveness:g} at most"
        else:
            continue
        known = {parameter.name: parameter for parameter in fault_parameters(channel, kind)}
        shown = ", ".join(
            f"{name} {known[name].written(channel, value, UnitSystem.paper)}" for name, value in parameters
        )
        found.append(f"fault: {kind} of {channel}{f' ({shown})' if shown else ''}; the certificate is for {why}")
    return found


def uncovered(
    values: Mapping[str, Any],
    design: ControlDesign | None,
    certificate: Mapping[str, Any] | None,
    faults: Iterable[tuple[str, str, Mapping[str, float]]],
) -> list[str]:
    """Return a message for each property of a flight that the certificate does not cover; empty if all are covered.

    Args:
        values: Flat parameters of the flight.
        design: Design of the flight.
        certificate: Certificate of the design, if available.
        faults: Channel, type and parameters (SI) of each fault.

    Raises:
        ParameterError: A wrong value, named.
        DesignError: The certificate does not state which loss of effectiveness it covers.
    """
    controller = str(validate(CONTROLLER_PARAMETERS, values)["controller"])
    if controller != _LAW or design is None or design.tube is None:
        which = "the design" if controller == _LAW else f"controller {controller}"
        return [f"all of it: {which} has no certified tube"]
    effectiveness = _effectiveness(certificate) if certificate else None
    changed = ["design: not as it was written, its parameters do not have the digest design.hash"]
    return [
        *(changed if design.modified else []),
        *uncovered_vehicle(values, design),
        *uncovered_hardware(values, design),
        *uncovered_faults(faults, effectiveness),
    ]


def _effectiveness(certificate: Mapping[str, Any]) -> float:
    field = "inputs.disturbance.elevator_effectiveness"
    value: Any = certificate
    for key in field.split("."):
        value = value.get(key) if isinstance(value, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0:
        raise DesignError(f"certificate: {field} = {value!r}: expected a number from 0 to 1")
    return float(value)


def commanded(design: ControlDesign) -> np.ndarray:
    """Return the largest magnitude (2) of a command: certified plan plus feedback in the tube."""
    bounds = design.plan_bounds
    if bounds is None:
        return np.maximum(np.abs(design.input_minimum), np.abs(design.input_maximum))
    lowest = bounds.region_minimum[:2] - (bounds.input_minimum - design.input_minimum)
    highest = bounds.region_maximum[:2] + (design.input_maximum - bounds.input_maximum)
    return np.maximum(np.abs(lowest), np.abs(highest))


def _actuators(v: Mapping[str, Any], design: ControlDesign) -> Iterator[str]:
    known = {ACTUATOR_SETS[name].channel: name for name in design.actuators}
    for i, channel in enumerate(INPUT_NAMES):
        where = f"actuator.{channel}"
        flown, certified = v[f"{where}.set"], known.get(channel, IDEAL)
        # A stop is judged below: it matters only if it is narrower than the largest command.
        own = [
            _quantity(p, v[p.name][0])
            for p in ACTUATOR_PARAMETERS
            if p.name.startswith(f"{where}.")
            and p.name != f"{where}.stop"
            and isinstance(v[p.name], list)
            and v[p.name]
        ]
        if flown != certified or own:
            shown = ", ".join([flown, *own]) if own else flown
            yield f"{where}: {shown}; the certificate is for {'an ideal one' if certified == IDEAL else certified}"
        given = v[f"{where}.stop"]
        stop = given[0] if given else ACTUATOR_SETS[flown].stop if flown != IDEAL else np.inf
        reach = commanded(design)[i]
        if stop < reach:
            unit = INPUT_UNITS[i]
            yield f"{where}.stop: {_written(stop, unit)}; the certificate lets commands go to {_written(reach, unit)}"


def _sensors(v: Mapping[str, Any], period: float) -> Iterator[str]:
    data = sensor_data(v, period)
    chosen = v["sensors.set"]
    of = f" (set {chosen})" if chosen != IDEAL else ""
    for i, (channel, unit) in enumerate(zip(STATE_NAMES, STATE_UNITS, strict=True)):
        errors = []
        for field in FIELDS:
            if field.name in _SENSOR_TIMES:
                continue
            value = float(getattr(data, _SENSOR_DATA.get(field.name, field.name))[i])
            if value != field.standard:
                name = field.name.replace("_", " ")
                # The data hold lag and random walk per period, so that their value is not in the unit of the field.
                errors.append(name if field.name in _SENSOR_DATA else f"{name} {_written(value, field.unit, unit)}")
        if data.inertial_angle_of_attack and channel == "angle_of_attack" and data.on[i]:
            errors.append("the error of the pitch angle")
        if errors:
            yield f"sensors.{channel}: {', '.join(errors)}{of}; the certificate is for an ideal one"


def _links(v: Mapping[str, Any]) -> Iterator[str]:
    for parameter in _LINK_PARAMETERS:
        where, _, name = parameter.name.rpartition(".")
        value = v[parameter.name]
        if value and name not in _LINK_DETAILS:
            unit = f" {parameter.unit}" if parameter.unit else ""
            yield f"{where}: {name.replace('_', ' ')} {value:g}{unit}; the certificate is for an ideal one"


def _air(v: Mapping[str, Any], period: float) -> Iterator[str]:
    if atmosphere_data(v, period).still:
        return
    for parameter in ATMOSPHERE_PARAMETERS:
        table, _, name = parameter.name.partition(".")
        value = v[parameter.name]
        largest = max(value, key=abs, default=0.0) if isinstance(value, list) else value
        if name not in _SHAPING and largest != 0.0:
            ideal = "the model's density" if table == "density" else "still air"
            yield f"{parameter.name}: {_quantity(parameter, largest)}; the certificate is for {ideal}"


def _quantity(parameter: Parameter, value: float) -> str:
    """Return the text of a value: with the parameter's name for an actuator, without it for the air."""
    name = parameter.name.rpartition(".")[2]
    if name == "natural_frequency":
        return f"natural frequency {value:g} rad/s"
    named = f"{name.replace('_', ' ')} " if parameter in ACTUATOR_PARAMETERS else ""
    return named + _written(value, parameter.unit)


def _written(value: float, pattern: str, unit: str = "") -> str:
    number, shown = to_paper(value, pattern.replace("{}", unit) or "1")
    return f"{number:.4g}" + ("" if shown == "1" else f" {shown}")
