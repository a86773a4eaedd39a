"""List the properties of a flight that the certificate of its design does not cover.

A certificate holds for a vehicle with its uncertainty, the actuators of the design, ideal sensors and links, still air
of the model's density, the commands of the flight in which W was measured, and one loss of elevator effectiveness: down
to the value in the inputs of the design, from a time in their window to the end. It says nothing about other flights,
which may succeed all the same; ``hsv certify`` looks for a certificate that covers other hardware.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.parameters import validate
from hsv.base.units import UnitSystem, quantity_text
from hsv.control.controller import CONTROLLER_PARAMETERS
from hsv.control.design import ControlDesign
from hsv.control.hardware import uncovered_hardware
from hsv.control.notch_filter import flown_sections
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.faults.injector import NEVER_TIME
from hsv.model.faults.table import fault_parameters
from hsv.model.signals import INPUT_NAMES, STATE_NAMES
from hsv.model.vehicle import Vehicle, load_vehicle

_LAW = "tube_mpc"
"""Name of the only controller that has a certificate."""

_LOSS = INPUT_NAMES[1], "loss_of_effectiveness"
"""Channel and type of the only fault that a certificate covers."""

_COMMANDS = ("initial.", "reference.")
"""Prefixes of the parameters of the initial point and the commands."""

_INSTANT = 1e-6
"""Difference between two times that are the same, s."""

_NO_STOP = 1e3
"""Position limit of an actuator that is never reached, because the vehicle's own input limits are smaller."""


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


class FlownFault(NamedTuple):
    """A fault of a flight: channel, type, parameters (SI), and the times at which it starts and ends, s."""

    channel: str
    type: str
    parameters: Mapping[str, float]
    start: float
    stop: float = NEVER_TIME


def uncovered_faults(
    faults: Iterable[FlownFault], declared: Mapping[str, Any] | None, duration: float = NEVER_TIME
) -> list[str]:
    """Return a message for each fault that the certificate does not cover, or that comes at another time.

    Args:
        faults: Faults of the flight.
        declared: The table ``inputs.disturbance`` of the certificate, or ``None`` if it is not known.
        duration: Duration of the flight, s.
    """
    found, losses = [], []
    for fault in faults:
        least = fault.parameters.get("effectiveness", 1.0)
        if (fault.channel, fault.type) != _LOSS:
            why = "a loss of elevator effectiveness alone"
        elif declared is None:
            why = "a loss whose size no available certificate states"
        elif least < declared["elevator_effectiveness"]:
            why = f"a loss to {declared['elevator_effectiveness']:g} at most"
        else:
            losses.append(fault)
            continue
        found.append(f"fault: {_fault_in_words(fault)}; the certificate is for {why}")
    if declared is not None and losses:
        first, last = declared["fault_window"] or [declared["fault_start"]] * 2
        window = f"{first:g} s" if first == last else f"{first:g} s to {last:g} s"
        times = [fault.start for fault in losses if not first - _INSTANT <= fault.start <= last + _INSTANT]
        found += [f"fault: at {time:g} s; the certificate is for {window}" for time in times]
        ends = [fault.stop for fault in losses if fault.stop < duration - _INSTANT]
        found += [f"fault: ends at {time:g} s; the certificate is for one that stays" for time in ends]
        if any(fault.parameters.get(name) for fault in losses for name in ("intermittent_period", "random_on")):
            found.append("fault: comes and goes; the certificate is for one that stays")
        if len(losses) > 1:
            found.append(f"fault: {len(losses)} losses of elevator effectiveness; the certificate is for one")
    return list(dict.fromkeys(found))


def _fault_in_words(fault: FlownFault) -> str:
    known = {parameter.name: parameter for parameter in fault_parameters(fault.channel, fault.type)}
    shown = ", ".join(
        f"{name} {known[name].written(fault.channel, value, UnitSystem.paper)}"
        for name, value in fault.parameters.items()
    )
    return f"{fault.type} of {fault.channel}{f' ({shown})' if shown else ''}"


def uncovered_commands(values: Mapping[str, Any], declared: Mapping[str, Any]) -> list[str]:
    """Return a message if initial point, commands or duration in ``values`` are not those ``declared`` by the region.

    Both are flat parameters, ``declared`` those of :func:`region_parameters`.
    """
    found = []
    if values.get("duration", 0.0) > declared["duration"] + _INSTANT:
        found.append(f"duration: {values['duration']:g} s; the certificate is for {declared['duration']:g} s at most")
    expected = {"reference.blend": 0.0, "reference.blends": [], "reference.trim": "climbing", **declared}
    for name, value in values.items():
        if name.startswith(_COMMANDS) and not _equal(value, expected.get(name)):
            given, certified = (" ".join(map(_number, np.atleast_1d(each))) for each in (value, expected[name]))
            found.append(f"{name}: {given}; the certificate is for {certified or 'none'}")
    return found


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _equal(value: Any, expected: Any) -> bool:
    if isinstance(value, str) or isinstance(expected, str):
        return bool(value == expected)
    return np.shape(value) == np.shape(expected) and bool(np.allclose(value, expected, rtol=1e-9, atol=0.0))


def uncovered(
    values: Mapping[str, Any],
    design: ControlDesign | None,
    certificate: Mapping[str, Any] | None,
    faults: Iterable[FlownFault],
) -> list[str]:
    """Return a message for each property of a flight that the certificate does not cover; empty if all are covered.

    Args:
        values: Flat parameters of the flight.
        design: Design of the flight.
        certificate: Certificate of the design, or None if it is not available.
        faults: Faults of the flight.

    Raises:
        ParameterError: A parameter is wrong; the message names it.
        DesignError: The certificate does not state which flights it covers.
    """
    controller = str(validate(CONTROLLER_PARAMETERS, values)["controller"])
    if controller != _LAW or design is None or design.tube is None:
        which = "the design" if controller == _LAW else f"controller {controller}"
        return [f"no certificate: {which} has no tube"]
    found = ["design: not as it was written, its parameters do not have the digest design.hash"] * design.modified
    found += [*uncovered_vehicle(values, design), *uncovered_hardware(values, design)]
    if certificate is None:
        return found + uncovered_faults(faults, None)
    try:
        declared = certificate["inputs"]["disturbance"]
        region = region_parameters(certificate["inputs"], load_vehicle())
        partly = only_share(certificate)
        found += uncovered_commands(values, region)
        found += uncovered_faults(faults, declared, values.get("duration", NEVER_TIME))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise DesignError(f"certificate: {error}: expected the region that it covers") from error
    return found + [f"disturbances: {partly}"] * bool(partly)


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
        f"rate of {name}: {quantity_text(rate, unit, UnitSystem.paper)}; "
        f"the bounds of the inputs are certified for {quantity_text(limit, unit, UnitSystem.paper)} at most"
        for name, unit, rate, limit, fast in found
        if fast
    ]


def only_share(certificate: Mapping[str, Any]) -> str:
    """Return what a ``certificate`` for a share of W says, in words; empty if it is for all of W."""
    share, flights = certificate["inputs"]["disturbance"]["share"], certificate["tube"]["flights"]
    left = f"{flights['outside']} of {flights['flights']} measured flights leave it"
    return f"certified for {share:g} W; {left}" if share < 1.0 else ""


def region_parameters(inputs: Mapping[str, Any], vehicle: Vehicle, share: float = 1.0) -> dict[str, Any]:
    """Return the flat parameters of the flight that the ``inputs`` (SI) of a design declare, without the design itself.

    The lost elevator effectiveness is ``share`` (0 to 1) times the declared loss (paper eq. 47).
    """
    declared, ramp = inputs["disturbance"], inputs["disturbance"].get("ramp")
    start, target = inputs["nominal"]["start"], inputs["nominal"]["target"]
    points = [start, target] if ramp else [target]
    values: dict[str, Any] = {
        "duration": declared["duration"],
        **vehicle.to_parameters(),
        "vehicle.coupling": declared["coupling"],
        "initial.altitude": start["altitude"],
        "initial.velocity": start["velocity"],
        "reference.times": [ramp["start"], ramp["end"]] if ramp else [0.0],
        "reference.altitudes": [point["altitude"] for point in points],
        "reference.velocities": [point["velocity"] for point in points],
        "fault.channels": ["elevator_deflection"],
        "fault.types": ["loss_of_effectiveness"],
        "fault.parameters": [f"effectiveness={1.0 - share * (1.0 - declared['elevator_effectiveness'])!r}"],
        "fault.starts": [declared["fault_start"]],
    }
    if ramp and ramp.get("blend"):
        values["reference.blend"] = ramp["blend"]
    for name in filter(None, (inputs.get("actuator") or {}).values()):
        channel = f"actuator.{ACTUATOR_SETS[name].channel}"
        values |= {f"{channel}.set": name, f"{channel}.stop": [_NO_STOP]}
    return values
