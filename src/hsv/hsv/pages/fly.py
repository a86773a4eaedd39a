"""The page that flies in the browser: prepared flights for the core in WebAssembly, and what a visitor can change."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hsv.base.errors import HsvError
from hsv.base.units import UnitSystem, in_system, readable, to_paper
from hsv.control.design_file import find_design, read_design
from hsv.core.web import Values, compile_module, layouts
from hsv.flight.assembly import assemble_flight, flight_parameters
from hsv.flight.closed_loop import flight_struct, is_ideal
from hsv.flight.fingerprint import published_fingerprint
from hsv.flight.history import History
from hsv.flight.metrics import METRICS, spaced
from hsv.flight.scenario import Scenario, load_scenario
from hsv.flight.side_by_side import TubeLevels
from hsv.model.dynamics import vehicle_struct
from hsv.model.faults.table import FAULT_KINDS, Fault
from hsv.model.signals import INPUT_NAMES, STATE_NAMES
from hsv.model.trim import CONVERGED, INITIAL_GUESS
from hsv.model.vehicle import Vehicle
from hsv.pages.engine import render
from hsv.pages.side_view import geometry

SITE = ""
"""Address of the published documentation, with a slash at its end; empty as long as it is not published."""

SCENARIOS = (
    *("case1", "case1_realistic", "case1_hard_sensors", "case1_heavy", "case1_active"),
    *("case2", "case2_uncertain", "winged_cone"),
)
"""Scenarios of the page."""

SHARE = (-20.0, 20.0, 0.5)
FIELDS: dict[str, tuple[str, str, str, tuple[float, float, float] | None]] = {
    "dh": ("command[0].altitude_change", "ft", "Commanded change of altitude", None),
    "dv": ("command[0].velocity_change", "ft/s", "Commanded change of velocity", None),
    "mass": ("vehicle.perturbation.mass", "%", "Mass", SHARE),
    "inertia": ("vehicle.perturbation.moment_of_inertia", "%", "Moment of inertia", SHARE),
    "elevator": ("vehicle.perturbation.moment_elevator", "%", "Elevator moment", SHARE),
    "tau": ("tube.tau", "", "Tube factor τ", None),
    "wind": ("wind.forward", "m/s", "Wind from behind", (-60.0, 60.0, 1.0)),
    "seed": ("seed", "", "Seed of noise and turbulence", (0, 2**31 - 1, 1)),
}
"""Settings of the page in addition to the fault, by their names in the address: scenario field, unit, label, and range
with step, unless these depend on the scenario."""

FAULTS: dict[str, tuple[str, str, tuple[float, float, float], float, dict[str, float]]] = {
    "loss_of_effectiveness": ("elevator_deflection", "effectiveness", (0.0, 1.0, 0.01), 0.9, {}),
    "lock_in_place": ("elevator_deflection", "", (0.0, 0.0, 1.0), 0.0, {}),
    "bias": ("elevator_deflection", "offset", (-0.1, 0.1, 0.002), 0.02, {}),
    "hard_over": ("elevator_deflection", "rate", (0.05, 1.0, 0.05), 0.2, {}),
    "oscillation": ("elevator_deflection", "amplitude", (0.0, 0.1, 0.002), 0.01, {"frequency": 2.0}),
    "thrust_loss": ("engine", "share", (0.0, 1.0, 0.01), 0.9, {}),
    "sensor_bias": ("pitch_rate", "offset", (-0.02, 0.02, 0.0005), 0.002, {}),
}
"""Faults of the page by type: channel, parameter that a slider sets, its range and step, its usual value, others."""


def prepared(scenario: Scenario, values: Values) -> dict[str, Any]:
    """Return the flight of ``scenario`` as plain data, with its arrays in ``values``; the core computes the reference.

    Raises:
        HsvError: A block of the loop is not in the core.
    """
    parts = assemble_flight(scenario)
    law, controller, plant = parts.nominal_trajectory.law, parts.controller, parts.plant
    if not (law.in_core and controller.in_core):
        raise HsvError(f"scenario {scenario.name!r}: flies with Python or a solver, expected all blocks in the core")
    history = History.empty(plant.steps + 1, estimated=not is_ideal(parts))
    struct = flight_struct(parts, history, set=TubeLevels(parts).set)
    computed = ("history", "auxiliary", "estimated", "reference")
    fields = {name: values.plain(value) for name, value in struct.values.items() if name not in computed}
    rigid = Vehicle.from_parameters(flight_parameters(scenario)).decoupled
    return {
        "title": scenario.title,
        "fingerprint": published_fingerprint(scenario.name),
        "period": plant.period,
        "rows": plant.steps + 1,
        "estimated": history.estimated is not None,
        "corners": [list(corner) for corner in parts.nominal_trajectory.reference.corners],
        "climbing": scenario.settings.get("reference.trim", "climbing") == "climbing",
        "rigid": values.plain(vehicle_struct(rigid)),
        "limits": [list(rigid.input_minimum), list(rigid.input_maximum)],
        "flight": {"struct": struct.kind, "values": fields},
    }


def _choices(scenario: Scenario, values: Values) -> dict[str, Any]:
    """Return what a visitor can change: ranges, steps and values of the settings, the fault, the limits judged."""
    design, vehicle = read_design(find_design(scenario.design)), scenario.vehicle.described
    [command], [fault] = scenario.command, scenario.fault
    start = scenario.initial.altitude, scenario.initial.velocity
    changes = command.altitude_change, command.velocity_change
    sliders: dict[str, list[float]] = {}
    axes = zip(
        ("dh", "dv"), ("m", "m/s"), start, changes, (vehicle.altitude_range, vehicle.velocity_range), strict=True
    )
    for key, unit, initial, change, ends in axes:
        low, high = (to_paper(end - initial, unit)[0] for end in ends)
        sliders[key] = [
            float(10 * round(low / 10)),
            float(10 * round(high / 10)),
            10.0,
            round(to_paper(change, unit)[0]),
        ]
    for key in ("mass", "inertia", "elevator"):
        name = FIELDS[key][0].rpartition(".")[2]
        if name in vehicle.uncertainty:
            sliders[key] = [*SHARE, round(100.0 * scenario.vehicle.perturbation.get(name, 0.0), 6)]
    if (least := max(design.tau_minimum)) < 1.0:
        sliders["tau"] = [float(least), 1.0, 0.01, float(design.tau[0])]
    sliders |= {"wind": [*(FIELDS["wind"][3] or ()), 0.0], "seed": [*(FIELDS["seed"][3] or ()), scenario.seed]}
    judged = [
        [name, spaced(name), limit, *in_system(1.0, METRICS[name].unit, UnitSystem.paper)]
        for name, limit in scenario.limits.items()
    ]
    return {
        "initial": list(start),
        "command": [command.start, command.end],
        "gain": values.plain(design.feedback_gain),
        "fault": {"fault": fault.type, "size": next(iter(fault.parameters.values()), 0.0), "at": fault.start},
        "sliders": sliders,
        "judged": judged,
    }


@cache
def _fault_kinds() -> dict[str, dict[str, Any]]:
    found = {}
    for name, (channel, parameter, size, usual, others) in FAULTS.items():
        kind = FAULT_KINDS[name]
        given = {**({parameter: usual} if parameter else {}), **others}
        names = [each.name for each in kind.parameters]
        units = {each.name: each.of(channel).unit for each in kind.parameters}
        found[name] = {
            "channel": channel,
            "code": kind.code,
            "side": kind.side,
            "slider": [*size, usual],
            "place": next((names.index(channel) for names in (INPUT_NAMES, STATE_NAMES) if channel in names), 0),
            "values": list(Fault.of(channel, name, given).values[: len(names)]),
            "size": names.index(parameter) if parameter else None,
            "parameter": parameter,
            "unit": units.get(parameter, ""),
            "others": {each: readable(value, units[each] or "1") for each, value in others.items()},
        }
    return found


def described(names: Sequence[str] = SCENARIOS) -> dict[str, Any]:
    """Return all that the page's script needs besides the module, for JSON; ``names`` are scenarios of the library."""
    values = Values()
    scenarios = {}
    for name in names:
        scenario = load_scenario(name)
        scenarios[name] = prepared(scenario, values) | (_choices(scenario, values) if name in SCENARIOS else {})
    return {
        "structs": layouts("hsv_flight"),
        "arrays": values.arrays,
        "scenarios": scenarios,
        "guess": INITIAL_GUESS.tolist(),
        "converged": CONVERGED,
        "fields": FIELDS,
        "kinds": _fault_kinds(),
    }


def fly_page(*options: str) -> str:
    """Compile the core with additional compiler ``options`` and return the page, which needs no other file.

    Raises:
        HsvError: See :func:`hsv.core.web.compile_module`.
    """
    with TemporaryDirectory() as folder:
        compile_module(module := Path(folder, "core.wasm"), *options)
        code = base64.b64encode(module.read_bytes()).decode()
    return render("fly.html.j2", described={**described(), "airframe": geometry(), "module": code}, airframe=geometry())


def fragment(scenario: Scenario) -> str | None:
    """Return the part after ``#`` of the page's address that flies ``scenario``; None if the page cannot.

    It holds the settings in which the scenario differs from one of the page; they may differ in nothing else.
    """
    own = _settings(scenario)
    for name in SCENARIOS:
        theirs = _settings(load_scenario(name))
        given = {key: value for key, value in own.items() if value != theirs.get(key)}
        if not all(_in_range(key, value, own) for key, value in given.items()):
            continue
        with suppress(HsvError):
            if load_scenario(name, _changes(own, given)).parameters() == scenario.parameters():
                return "&".join([name, *(f"{key}={value}" for key, value in given.items())])
    return None


def _in_range(key: str, value: float | str, own: Mapping[str, float | str]) -> bool:
    """Return whether the page accepts the ``value`` of a setting that is not a choice; a scenario checks the others."""
    ranges = {name: entry[3] for name, entry in FIELDS.items()} | {"at": (1.0, 199.0, 1.0)}
    if str(own["fault"]) in FAULTS:
        ranges["size"] = FAULTS[str(own["fault"])][2]
    limits = ranges.get(key)
    return limits is None or limits[0] <= float(value) <= limits[1]


def _settings(scenario: Scenario) -> dict[str, float | str]:
    """Return the settings of the page that fly a ``scenario``, as far as there are some for it, by their names."""
    found: dict[str, float | str] = {"fault": "none", "seed": scenario.seed}
    if len(scenario.command) == 1:
        change = scenario.command[0]
        found["dh"], found["dv"] = to_paper(change.altitude_change, "m")[0], to_paper(change.velocity_change, "m/s")[0]
    for fault in scenario.fault[:1]:
        found |= {"fault": fault.type, "at": fault.start}
        if size := FAULTS.get(fault.type, ("", ""))[1]:
            found["size"] = fault.parameters.get(size, 0.0)
    shares = {FIELDS[key][0].rpartition(".")[2]: key for key in ("mass", "inertia", "elevator")}
    found |= {shares[name]: 100.0 * share for name, share in scenario.vehicle.perturbation.items() if name in shares}
    found |= {"tau": scenario.tube.tau[0]} if scenario.tube.tau else {}
    found["wind"] = scenario.settings.get("wind.forward", 0.0)
    # The page rounds to six digits, too; what a scenario has beyond them, it cannot fly.
    return {key: round(value, 6) if isinstance(value, float) else value for key, value in found.items()}


def _changes(own: Mapping[str, float | str], given: Mapping[str, float | str]) -> dict[str, object]:
    """Return the changed fields of a scenario, as in a file, for the settings ``given`` of all its ``own``."""
    found: dict[str, object] = {}
    for key in given.keys() & FIELDS.keys():
        field, unit, *_ = FIELDS[key]
        found[field] = f"{given[key]!r} {unit}" if unit else given[key]
    if given.keys() & {"fault", "size", "at"}:
        found["fault"] = []
        if kind := _fault_kinds().get(name := str(own["fault"])):
            size = f"{own['size']!r} {kind['unit']}" if kind["unit"] else own.get("size")
            sized = {kind["parameter"]: size} if kind["parameter"] else {}
            row = {"channel": kind["channel"], "type": name, "start": f"{own['at']!r} s"}
            found["fault"] = [row | sized | kind["others"]]
    return found
