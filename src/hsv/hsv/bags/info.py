"""Contents and events of a bag as plain data for JSON."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hsv.bags.description import (
    ACTUATOR,
    COMMAND,
    CONTROLLER,
    CONTROLLERS,
    DIAGNOSTICS,
    NOMINAL_TRAJECTORY,
    STATE,
    TUBE_MPC,
    TUBE_STATUS,
)
from hsv.bags.flight import (
    effectors,
    equipment_topics,
    flight_data,
    flight_fingerprint,
    held,
    input_columns,
    measurement_errors,
    moving_air,
    published_levels,
)
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.steps import bag_warnings, complete_stamps, cut_off, joined
from hsv.base.errors import HsvError, ParameterError, RecordingError
from hsv.base.files import parse_json
from hsv.certificate.coverage import FlownFault, uncovered
from hsv.control.design import design_of
from hsv.control.design_file import FORMAT
from hsv.flight.fingerprint import as_published
from hsv.flight.requirement import margins, requirement_rows
from hsv.flight.scenario import Scenario, parse_scenario
from hsv.model.faults.injector import NEVER_TIME
from hsv.model.faults.table import FAULT_KINDS, SENSOR
from hsv.model.faults.table import fault_parameters as parameters_of
from hsv.model.signals import INPUT_NAMES

_LAW_NODES = (NOMINAL_TRAJECTORY.name, CONTROLLER.name, *CONTROLLERS)
_STEP_TIME = "step_time_"


def describe(bag: Bag) -> dict[str, Any]:
    """Return the contents and events of a bag; callers add to the dictionary, for example metrics.

    Returns:
        ``path``, ``folder``, ``warnings`` (texts), ``complete`` (whether there are none), ``start_s``, ``duration_s``,
        ``messages``, ``topics``, ``custom_data``, ``fingerprint`` (None if steps are missing), ``as_published`` (None
        without a published value), ``attachments``, ``ending`` (finished, diverged or broken off), ``faults`` (one
        entry per interval), ``equipment`` (deviations of sensors, links, effectors and air from the ideal, SI),
        ``step_times`` (wall times of the steps of the control law in ms, by node, and the control period),
        ``requirements`` (rows of :func:`hsv.flight.requirement.requirement_rows`), ``saturation``, ``tube``,
        ``not_covered`` (texts: properties of the flight outside the certificate of its design) and ``disk_margin`` (see
        :func:`hsv.flight.margins.margin_verdict`). From ``ending`` on, an entry is None if its topics or other data for
        it are missing. Names that end in ``_s`` are simulated times in seconds; ``end_s`` is None if an interval lasts
        until the end of the bag.
    """
    start, end = bag.span
    fingerprint, warnings = None, bag_warnings(bag)
    with suppress(RecordingError):
        fingerprint = flight_fingerprint(bag)
    topics = [_topic(bag, name) for name in sorted(bag.topics)]
    faults, scenario = _faults(bag) if ACTUATOR in bag.roles else None, attached_scenario(bag)
    return {
        "path": str(bag.path),
        "folder": str(bag.folder),
        "complete": not warnings,
        "warnings": warnings,
        "start_s": start / 1e9,
        "duration_s": (end - start) / 1e9,
        "messages": sum(topic["messages"] for topic in topics),
        "topics": topics,
        "custom_data": bag.custom_data,
        "fingerprint": fingerprint,
        "as_published": as_published(fingerprint, scenario, bag.custom_data.get("design_hash", "")),
        "attachments": [
            {"name": name, "media_type": bag.media_types[name], "size_bytes": len(data)}
            for name, data in sorted(bag.attachments.items())
        ],
        "ending": ending(bag) if STATE in bag.roles else None,
        "faults": faults,
        "equipment": _equipment(bag) if STATE in bag.roles else None,
        "step_times": _step_times(bag) if DIAGNOSTICS in bag.roles and STATE in bag.roles else None,
        "requirements": _requirements(bag),
        "saturation": _saturation(bag) if COMMAND in bag.roles else None,
        "tube": _tube(bag) if TUBE_STATUS in bag.roles else None,
        "not_covered": _not_covered(bag, faults) if TUBE_STATUS in bag.roles else None,
        "disk_margin": _disk_margin(bag, scenario),
    }


def attached_scenario(bag: Bag) -> Scenario | None:
    """Return the scenario attached to ``bag``, or ``None`` if there is none that this version can read."""
    try:
        return parse_scenario(bag.text("scenario.toml"), bag.custom_data.get("scenario", ""))
    except HsvError:
        return None


def _requirements(bag: Bag) -> list[dict[str, Any]] | None:
    """Return the margins of the requirements of the attached scenario; None if no step of the flight is complete."""
    scenario = attached_scenario(bag)
    if not scenario or not scenario.requirement:
        return []
    try:
        flight = flight_data(bag)
    except (RecordingError, KeyError):
        return None
    ended = ending(bag) == "finished"
    found = margins(scenario.requirement, flight, ended=ended, levels=lambda: published_levels(bag))
    return requirement_rows(scenario.requirement, found, flight.time)


def _topic(bag: Bag, name: str) -> dict[str, Any]:
    topic, times = bag.topics[name], bag.times(name)
    span = int(times.max() - times.min()) if len(times) else 0
    rate = (len(times) - 1) / (span / 1e9) if span else None
    return {"name": name, "type": topic.type, "messages": topic.count, "rate_hz": rate}


def ending(bag: Bag) -> str:
    """Return how the flight in ``bag`` ended: ``finished``, ``diverged`` or ``broken off``."""
    status = bag.columns(STATE)["status"]
    if cut_off(bag) and len(status) and bag.times(STATE)[-1] not in complete_stamps(bag):
        return "broken off"  # the last state is recorded, but other topics of its step are not
    endings = {bag.constant(STATE, "FINISHED"): "finished", bag.constant(STATE, "DIVERGED"): "diverged"}
    return endings.get(int(status[-1]), "broken off") if len(status) else "broken off"


def _described(fault: dict[str, Any]) -> tuple[Any, ...]:
    parameters = zip(fault["parameter_names"], map(float, fault["parameter_values"]), strict=False)
    return fault["channel"], fault["type"], *parameters


def _faults(bag: Bag) -> list[dict[str, Any]]:
    columns = bag.columns(ACTUATOR)
    active = [[_described(fault) for fault in faults] for faults in columns["active"]]
    found = []
    for key in sorted({fault for faults in active for fault in faults}):
        channel, kind, *parameters = key
        entry = {"channel": channel, "type": kind, "parameters": dict(parameters)}
        acting = np.array([key in faults for faults in active])
        if kind in FAULT_KINDS and FAULT_KINDS[kind].side == SENSOR:
            # A step lists the sensor faults of the next step; the first step also lists those that it has itself.
            acting = np.concatenate((acting[:1], acting[:-1]))
        found += [entry | interval for interval in intervals(columns["header.stamp"], acting)]
    return sorted(found, key=lambda interval: interval["start_s"])


def parameters_in_words(fault: dict[str, Any], written: Callable[[float, str], str]) -> str:
    """Return the parameters of a fault as text: the quantity of a single one, names and quantities of several.

    Args:
        fault: Entry of ``faults`` in :func:`describe`.
        written: Function that formats a number with its SI unit (empty if none or unknown); not called for rad/s.
    """
    given = fault["parameters"]
    try:
        known = {parameter.name: parameter for parameter in parameters_of(fault["channel"], fault["type"])}
    except ParameterError:
        known = {}
    words = []
    for name, value in given.items():
        if name in known and known[name].unit == "rad/s":
            quantity = f"{value:g} rad/s"  # a frequency, in every system of units
        else:
            quantity = written(value, known[name].of(fault["channel"]).unit if name in known else "")
        words.append(f"{name} {quantity}" if len(given) > 1 else quantity)
    return ", ".join(words)


def _equipment(bag: Bag) -> dict[str, Any] | None:
    """Return how measurements, links, effectors and air deviate from the ideal, SI; None if no step is complete."""
    try:
        topics = joined(bag, equipment_topics(bag))
    except RecordingError:
        return None
    commanded = input_columns(topics[ACTUATOR]) if ACTUATOR in topics else np.empty((0, len(INPUT_NAMES)))
    errors = {name: y - commanded[:, INPUT_NAMES.index(name)] for name, y in effectors(topics).items()}
    return {
        "measurement_error_rms": {n: float(np.sqrt(np.mean(e**2))) for n, e in measurement_errors(topics).items()},
        "held_steps": {name: int(steps.sum()) for name, steps in held(topics).items()},
        "effector_largest_difference": {name: float(np.nanmax(np.abs(error))) for name, error in errors.items()},
        "air_range": {name: [float(np.nanmin(air)), float(np.nanmax(air))] for name, air in moving_air(topics).items()},
    }


def _not_covered(bag: Bag, faults: list[dict[str, Any]] | None) -> list[str] | None:
    """Return a text on each property of the flight outside its certificate; None if attachments are missing or bad."""
    try:
        values, certificate = _attached(bag)
        if isinstance(certificate, dict) and (version := certificate.get("format", 1)) != FORMAT:
            return [f"all of it: certificate.json has format {version!r}, expected {FORMAT}; fly the design of today"]
        return uncovered(values, design_of(values), certificate, map(_flown, faults or ()))
    except (HsvError, ValueError, LookupError, TypeError, OverflowError):
        return None  # the attachments are of another version, incomplete or damaged


def _attached(bag: Bag) -> tuple[dict[str, Any], Any]:
    """Return the parameters of the tube law in the attached files, and the attached certificate, None without one."""
    sections = [ParameterSections.parse(bag.text(name), name) for name in ("design.yaml", "scenario.yaml")]
    report = bag.attachments.get("certificate.json")
    return sections[0].overlaid(sections[1]).of(TUBE_MPC.name), parse_json(report) if report else None


def _disk_margin(bag: Bag, scenario: Scenario | None) -> dict[str, Any] | None:
    """Return the verdict on the disk margin by the attached design and certificate; None if none is required."""
    if scenario is None or scenario.disk_margin is None:
        return None
    from hsv.flight.margins import margin_verdict

    design, certificate = None, None
    # The attachments may be of another version, incomplete or damaged.
    with suppress(HsvError, ValueError, LookupError, TypeError, OverflowError):
        values, certificate = _attached(bag)
        design = design_of(values)
    return margin_verdict(scenario, design, certificate or {})


def _flown(fault: dict[str, Any]) -> FlownFault:
    end = NEVER_TIME if fault["end_s"] is None else fault["end_s"]
    return FlownFault(fault["channel"], fault["type"], fault["parameters"], fault["start_s"], end)


def _step_times(bag: Bag) -> dict[str, Any] | None:
    """Return the step times last reported by the control nodes, and the control period, ms; None if not recorded."""
    statistics = ("median_ms", "p99_ms", "max_ms")
    nodes: dict[str, dict[str, float]] = {}
    try:
        for _, message in bag.decode(DIAGNOSTICS):
            for status in message.status:
                values = {pair.key.removeprefix(_STEP_TIME): pair.value for pair in status.values}
                if (node := status.name.partition(":")[0]) in _LAW_NODES and values.keys() >= {*statistics}:
                    nodes[node] = {name: float(values[name]) for name in statistics}
        stamps = bag.times(STATE)
    except (RecordingError, ValueError, AttributeError):
        return None  # the diagnostics of another program
    period = float(stamps[1] - stamps[0]) / 1e6 if len(stamps) > 1 else 0.0
    return {"period_ms": period, "nodes": nodes} if nodes and period else None


def _saturation(bag: Bag) -> dict[str, Any]:
    saturated = bag.columns(COMMAND)["saturated"]
    return {
        "steps": int(saturated.any(axis=1).sum()),
        "fuel_equivalence_ratio_steps": int(saturated[:, 0].sum()),
        "elevator_deflection_steps": int(saturated[:, 1].sum()),
    }


def _tube(bag: Bag) -> dict[str, Any]:
    columns, constants = bag.columns(TUBE_STATUS), bag.constants(TUBE_STATUS)
    checked = columns["status"] != bag.constant(TUBE_STATUS, "NO_SET")
    outside = checked & ~columns["inside"]
    levels = columns["level"][checked & np.isfinite(columns["level"])]
    uncertified = {"steps": "VEHICLE"} | {f"{name.lower()}_steps": name for name in ("HARDWARE", "RATE", "DISTURBANCE")}
    return {
        "checked_steps": int(checked.sum()),
        "outside_steps": int(outside.sum()),
        "largest_level": float(levels.max()) if len(levels) else None,
        "excursions": intervals(columns["header.stamp"], outside),
        **{
            f"uncertified_{steps}": int((columns["status"] == constants.get(f"UNCERTIFIED_{name}", -1)).sum())
            for steps, name in uncertified.items()
        },
    }


def intervals(stamps: NDArray[np.int64], holds: NDArray[np.bool_]) -> list[dict[str, Any]]:
    """Return the intervals (s) in which a condition is met; ``holds`` (bool) and ``stamps`` (ns) have a value per step.

    ``start_s`` is the time of the first step in an interval, ``end_s`` that of the first step after it, or None.
    """
    edges = np.diff(np.concatenate(([False], holds, [False])).astype(np.int8))
    return [
        {"start_s": float(stamps[first]) / 1e9, "end_s": float(stamps[over]) / 1e9 if over < len(stamps) else None}
        for first, over in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    ]
