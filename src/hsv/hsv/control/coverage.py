"""Everything in a flight that its certificate does not cover: vehicle, hardware, air, law, faults.

A certificate holds for a vehicle with its uncertainty, for the actuators that the design knows, ideal sensors and
links, still air of the model's density, and a loss of elevator effectiveness down to that of the design's inputs. What
else a flight declares may be survived, and may even be certified with (``hsv certify``), but this certificate does not
say so.
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
"""The hardware that a flight declares."""

_LAW = "tube_mpc"
"""The only controller that has a certificate."""

_SENSOR_DATA = {"random_walk": "walk", "lag": "lag_decay"}
"""Fields of sensors that their compiled data has in another form."""

_SENSOR_TIMES = ("drift_time",)
"""Fields that are nothing by themselves."""

_LINK_DETAILS = ("burst", "checksum")
"""Parameters of links that have no effect without a loss or a corruption."""

_SHAPING = ("shear_altitude", "length", "length_forward", "length_up", "lengths", "stays", "starts")
"""Parameters of the air that have no effect without a velocity or a density."""


def uncovered_hardware(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return what of the hardware in flat parameters, estimator included, the certificate of ``design`` has not.

    Raises:
        ParameterError: A wrong value, named.
    """
    v = validate(HARDWARE_PARAMETERS, values)
    found = [*_actuators(v, design), *_sensors(v, design.period), *_links(v), *_air(v, design.period)]
    if v[ESTIMATOR_ENABLED.name]:
        found.append("estimator: the certificate has none in the loop")
    return found


def uncovered_vehicle(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return what of the vehicle and of the law in flat parameters the certificate of ``design`` has not.

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
    """Return which of the faults are not a loss of elevator effectiveness that the certificate covers.

    Args:
        faults: Channel, type and parameters (SI) of each.
        effectiveness: The least that is certified; ``None``: not known.
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
        said = ", ".join(
            f"{name} {known[name].written(channel, value, UnitSystem.paper)}" for name, value in parameters
        )
        found.append(f"fault: {kind} of {channel}{f' ({said})' if said else ''}; the certificate is for {why}")
    return found


def uncovered(
    values: Mapping[str, Any],
    design: ControlDesign | None,
    certificate: Mapping[str, Any] | None,
    faults: Iterable[tuple[str, str, Mapping[str, float]]],
) -> list[str]:
    """Return what of a flight no certificate covers, an entry a thing; empty where all of it is covered.

    Args:
        values: Flat parameters of the flight.
        design: Its design.
        certificate: Certificate of the design, if available.
        faults: Channel, type and parameters (SI) of each.

    Raises:
        ParameterError: A wrong value, named.
        DesignError: The certificate does not say which loss of effectiveness it covers.
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
    """Return the largest magnitude (2) of a command: that of a certified plan plus the feedback in the tube."""
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
        # The stops of the vehicle, which the tightened inputs avoid, hold as well as those of the actuator.
        own = [
            _quantity(p, v[p.name][0])
            for p in ACTUATOR_PARAMETERS
            if p.name.startswith(f"{where}.")
            and p.name != f"{where}.stop"
            and isinstance(v[p.name], list)
            and v[p.name]
        ]
        if flown != certified or own:
            said = ", ".join([flown, *own]) if own else flown
            yield f"{where}: {said}; the certificate is for {'an ideal one' if certified == IDEAL else certified}"
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
        said = []
        for field in FIELDS:
            if field.name in _SENSOR_TIMES:
                continue
            value = float(getattr(data, _SENSOR_DATA.get(field.name, field.name))[i])
            if value != field.standard:
                name = field.name.replace("_", " ")
                # Lag and random walk are kept as what they are over a period.
                said.append(name if field.name in _SENSOR_DATA else f"{name} {_written(value, field.unit, unit)}")
        if data.inertial_angle_of_attack and channel == "angle_of_attack" and data.on[i]:
            said.append("the error of the pitch angle")
        if said:
            yield f"sensors.{channel}: {', '.join(said)}{of}; the certificate is for an ideal one"


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
    """Return name and value of an actuator's parameter, the value of one of the air."""
    name = parameter.name.rpartition(".")[2]
    if name == "natural_frequency":
        return f"natural frequency {value:g} rad/s"
    named = f"{name.replace('_', ' ')} " if parameter in ACTUATOR_PARAMETERS else ""
    return named + _written(value, parameter.unit)


def _written(value: float, pattern: str, unit: str = "") -> str:
    number, shown = to_paper(value, pattern.replace("{}", unit) or "1")
    return f"{number:.4g}" + ("" if shown == "1" else f" {shown}")
