"""List the properties of a flight that the certificate of its design does not cover.

A certificate holds for a vehicle with its uncertainty, the actuators of the design, ideal sensors and links, still air
of the model's density, and a loss of elevator effectiveness down to the value in the inputs of the design. It says
nothing about other flights, which may succeed all the same; ``hsv certify`` looks for a certificate that covers them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.parameters import validate
from hsv.base.units import UnitSystem, in_words
from hsv.control.controller import CONTROLLER_PARAMETERS
from hsv.control.design import ControlDesign
from hsv.control.hardware import uncovered_hardware
from hsv.control.notch_filter import flown_sections
from hsv.model.faults.table import fault_parameters
from hsv.model.signals import INPUT_NAMES, STATE_NAMES
from hsv.model.vehicle import Vehicle

_LAW = "tube_mpc"
"""Name of the only controller that has a certificate."""


def uncovered_vehicle(values: Mapping[str, Any], design: ControlDesign) -> list[str]:
    """Return a message for each property of vehicle, notch filter and law that the certificate does not cover."""
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
        certificate: Certificate of the design, or None if it is not available.
        faults: Channel, type and parameters (SI) of each fault.

    Raises:
        ParameterError: A parameter is wrong; the message names it.
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


def uncovered_rates(design: ControlDesign | None, states: np.ndarray) -> list[str]:
    """Return a message for altitude and velocity if they change faster than ``design`` is certified for, if limited.

    ``states`` (k, 9) are those of a flight, one row per step.
    """
    if design is None or design.tube is None or not len(design.tube.rates):
        return []
    moved = np.abs(np.diff(states[:, :2], axis=0)).max(axis=0, initial=0.0)
    too_fast = design.tube.too_fast(moved, design.period)
    found = zip(STATE_NAMES, ("m/s", "m/s^2"), moved / design.period, design.tube.rates, too_fast, strict=False)
    return [
        f"rate of {name}: {in_words(rate, unit, UnitSystem.paper)}; "
        f"the bounds of the inputs are certified for {in_words(limit, unit, UnitSystem.paper)} at most"
        for name, unit, rate, limit, fast in found
        if fast
    ]
