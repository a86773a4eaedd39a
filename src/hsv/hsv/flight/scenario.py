"""Scenarios: a flight as a TOML file with units, and as the flat parameters of the components."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import Field, PrivateAttr, StrictInt, ValidationError

from hsv.base.errors import DocumentError, HsvError, Mistakes, ParameterError, ScenarioError, one_of, require
from hsv.base.files import EXTENDS, follow_extends, is_path, parse_toml, read_text
from hsv.base.parameters import Parameter, table_values
from hsv.control.controller import SHIPPED_CONTROLLERS
from hsv.control.design import TAU, rigid_factors
from hsv.control.effectiveness import EFFECTIVENESS_PARAMETERS
from hsv.control.estimator import ESTIMATOR_PARAMETERS
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import FLOWN_NOTCH_PARAMETERS, NOTCH_PARAMETERS
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS
from hsv.control.tube_law import TUBE_PARAMETERS
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.flight.distribution import KINDS, Distribution
from hsv.flight.metrics import METRICS
from hsv.flight.requirement import Requirement, read_requirements
from hsv.flight.tables import (
    Breakpoints,
    CommandTable,
    FaultTable,
    InitialTable,
    Reading,
    Table,
    Time,
    TubeTable,
    VehicleTable,
    breakpoints,
    check_envelope,
    dotted,
    refused,
    renamed,
    set_field,
    tables_in,
)
from hsv.model.faults.injector import NEVER_TIME, written_parameters
from hsv.model.faults.table import Fault
from hsv.model.links import COMMAND_LINK_PARAMETERS
from hsv.model.plant import EQUIPMENT_PARAMETERS, check_equipment
from hsv.model.vehicle import DEFAULT_VEHICLE, SHIPPED_VEHICLES, vehicle_label, vehicle_tables
from hsv.plugins.library import find_in, inside


class Scenario(Table):
    """The description of a flight: vehicle, initial point, commands, controller, design, faults, requirements."""

    name: str
    title: Annotated[str, Field(pattern=r"\S")]
    design: str = "baseline"
    """Name or path of the controller's design; empty: none"""
    controller: str = "tube_mpc"
    """A registered name, ``package.module:Class``, ``node:...``, or the absolute path of ``lib.so:symbol`` or an FMU"""
    duration: Time
    vehicle: VehicleTable = VehicleTable()
    initial: InitialTable
    command: tuple[CommandTable, ...] = ()
    tube: TubeTable = TubeTable()
    fault: tuple[FaultTable, ...] = ()
    seed: Annotated[StrictInt, Field(ge=0, le=SEED_PARAMETER.maximum)] = 0
    """Seed of all random numbers"""
    settings: dict[str, Any] = Field(default_factory=dict)
    """Parameters of the components, SI, by their dotted names in a file, from the tables :data:`SETTINGS`"""
    own: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Tables of a custom controller, as written in the file; only the class of the controller can interpret them"""
    limits: dict[str, float] = Field(default_factory=dict)
    """Largest admissible magnitudes of metrics, SI, by name"""
    requirement: tuple[Requirement, ...] = ()
    """Requirements, whose margins are metrics"""
    disk_margin: float | None = None
    """Smallest admissible disk margin of the elevator loop, from the table of limits; None: none is required"""
    _text: str = PrivateAttr("")

    @property
    def text(self) -> str:
        """The complete TOML text from which :func:`parse_scenario` read the scenario; empty for other scenarios."""
        return self._text

    @property
    def commands(self) -> Breakpoints:
        """The breakpoints of the reference that the commands define: times (s), altitudes (m) and velocities (m/s)."""
        return breakpoints(self.initial.altitude, self.initial.velocity, self.command)

    def parameters(self) -> dict[str, Any]:
        """Return the flat parameters of this scenario, without those of a custom controller.

        They determine the flight together with the design and a custom controller's parameters, see
        :func:`hsv.flight.assembly.scenario_parameters`.
        """
        values: dict[str, Any] = {
            "duration": self.duration,
            **self.vehicle.described.to_parameters(),
            "vehicle.digest": self.vehicle.described.digest,
            "vehicle.model": self.vehicle.model,
            "vehicle.coupling": self.vehicle.coupling,
            "initial.altitude": self.initial.altitude,
            "initial.velocity": self.initial.velocity,
            "controller": self.controller,
        }
        values |= {f"reference.{name}": list(column) for name, column in self.commands._asdict().items()}
        values |= {f"vehicle.perturbation.{name}": value for name, value in self.vehicle.perturbation.items()}
        if self.tube.tau:
            values["feedback.tau"] = list(self.tube.tau)
        if self.tube.change:
            # A flat parameter is a list of numbers, so the five factors of all changes follow one another.
            values["tau_change.starts"] = [change.start for change in self.tube.change]
            values["tau_change.values"] = [
                tau for change in self.tube.change for tau in rigid_factors(change.tau, "tube.change.tau").tolist()
            ]
        if self.fault:
            values["fault.channels"] = [fault.channel for fault in self.fault]
            values["fault.types"] = [fault.type for fault in self.fault]
            values["fault.parameters"] = [written_parameters(fault.parameters) for fault in self.fault]
            values["fault.starts"] = [fault.start for fault in self.fault]
            values["fault.stops"] = [NEVER_TIME if fault.stop is None else fault.stop for fault in self.fault]
        settings = {_FLOWN_NOTCH.get(name, name): value for name, value in self.settings.items()}
        return values | {"seed": self.seed} | settings


PERIOD = 0.02
"""Control period (s) for checks of the equipment before the design is known; their result does not depend on it."""

_FLOWN_NOTCH = {p.name.replace("notch.flown.", "notch."): p.name for p in FLOWN_NOTCH_PARAMETERS}
"""Names of the parameters of a notch filter that replaces the design's, by their names in a scenario file."""

_LOOP_PARAMETERS = ("reference.trim", "reference.blend", "notch.enabled", "nominal.law", "integral.rate")
"""Parameters of reference, filter and laws that a file sets; a design or the scenario's commands set the others."""

_PARAMETERS = (
    *(p for p in (*NominalTrajectory.PARAMETERS, *NOTCH_PARAMETERS, *TUBE_PARAMETERS) if p.name in _LOOP_PARAMETERS),
    *(replace(parameter, name=name) for name, parameter in zip(_FLOWN_NOTCH, FLOWN_NOTCH_PARAMETERS, strict=True)),
    *ROBUST_MPC_PARAMETERS,
    *EQUIPMENT_PARAMETERS,
    *COMMAND_LINK_PARAMETERS,
    *ESTIMATOR_PARAMETERS,
    *EFFECTIVENESS_PARAMETERS,
)

SETTINGS = frozenset(parameter.name.partition(".")[0] for parameter in _PARAMETERS)
"""Tables of a scenario file that set parameters of components: reference, filter, laws, hardware and estimators."""

_LIMITS = tuple(
    Parameter(f"limits.{name}", 0.0, metric.meaning, metric.unit, 0.0, whole=metric.counted)
    for name, metric in METRICS.items()
)

_DISK_MARGIN = Parameter("limits.disk_margin", 0.0, "smallest disk margin of the elevator loop", "", 0.0, 2.0)

_FAULT = FaultTable.model_fields.keys() - {"parameters"}
"""Keys of every fault in a file, whatever its type."""

_NO_KEYS = ("name", "own", "settings", "disk_margin")
"""Fields of a scenario that are not keys of its file."""

_CONTROLLER_TABLES = dict.fromkeys(("tube", "integral", "effectiveness"), "tube_mpc") | {"robust_mpc": "robust_mpc"}
"""Tables that only one of the shipped controllers reads, each with the name of that controller."""

REPLACED = ("limits",)
"""Tables that replace those of the extended scenario as a whole; all other tables are merged."""


def scenario_names() -> list[str]:
    """Return the names of the shipped scenarios."""
    return sorted(Path(entry.name).stem for entry in _shipped().iterdir() if entry.name.endswith(".toml"))


def scenario_text(name: str, changes: Mapping[str, object] | None = None) -> str:
    """Return the complete TOML text of a scenario, given by name or path, with ``changes`` of its fields.

    The text includes the extended scenarios, and the vehicle unless it is shipped. Paths of libraries are absolute. A
    file that extends another one without a title of its own, and a changed scenario, say so in the title.

    Raises:
        ScenarioError: A scenario or vehicle cannot be found or read, a library lies outside the scenario's folder, or
            there is no such field.
    """
    require("scenario", name, str, "a name, or a path as text")
    require("changes", changes or {}, Mapping, 'values by field, such as {"fault[0].start": "90 s"}')
    text = _own_text(name)
    own = scenario_table(text, name)
    whole = follow_extends(
        name, lambda other: _located(scenario_table(_own_text(other), other), other), refused, REPLACED, KINDS
    )
    if EXTENDS in own and "title" not in own:
        whole["title"] = f"{Path(name).stem} (from {Path(own[EXTENDS]).stem})"
    for field, value in (changes or {}).items():
        set_field(whole, field, value, name)
        whole = _with_named_vehicle(whole, name)
        if field == "vehicle.name":
            whole["vehicle"].pop("definition", None)
    if changes and changes.keys() & {"controller", "vehicle", "vehicle.name"}:
        whole = _located(whole, name)
    if changes and "title" not in changes:
        words = ", ".join(f"{field} = {value}" for field, value in changes.items())
        whole["title"] = f"{whole.get('title', name)}, with {words}"
    whole = _with_definition(whole, name)
    return text if whole == own else tomli_w.dumps(whole)


def _located(table: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the ``table`` of the scenario file ``name`` with the paths in it resolved from the file's folder.

    The path of a library becomes absolute. A vehicle's name also cancels a vehicle definition in extended scenarios.
    """
    folder = Path(name).parent if is_path(name) else Path()
    controller, vehicle = table.get("controller"), table.get("vehicle", {})
    located = dict(table)
    if "name" in vehicle and "definition" not in vehicle:
        place = str(folder / vehicle["name"]) if is_path(vehicle["name"]) else vehicle["name"]
        located["vehicle"] = {**vehicle, "name": place, "definition": None}
    if isinstance(controller, str):
        if is_path(name):
            find_in(folder, controller)
        try:
            located["controller"] = inside(controller, folder)
        except ParameterError as error:
            raise refused(name, error) from error
    return located


def _with_definition(table: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the ``table`` of a scenario with the contents of its vehicle file, unless the vehicle is shipped."""
    vehicle = {key: value for key, value in table.get("vehicle", {}).items() if value is not None}
    place = vehicle.get("name", DEFAULT_VEHICLE)
    if "definition" not in vehicle and place not in SHIPPED_VEHICLES:
        try:
            vehicle |= {"name": vehicle_label(place), "definition": vehicle_tables(place)}
        except HsvError as error:
            raise refused(name, error) from error
    return {**table, "vehicle": vehicle} if vehicle else table


def _own_text(name: str) -> str:
    if name not in scenario_names() and (name.endswith(".mcap") or any(Path(name).glob("*.mcap*"))):
        raise ScenarioError(f"scenario {name!r}: a bag, expected a TOML file (hsv replay {name} flies a bag again)")
    if is_path(name):
        try:
            return read_text(Path(name))
        except DocumentError as error:
            raise ScenarioError(f"scenario {name!r}: {error}, expected a TOML file") from error
    if name not in scenario_names():
        raise ScenarioError(f"scenario {name!r}: expected a path or {one_of(scenario_names(), name)}")
    return _shipped().joinpath(f"{name}.toml").read_text(encoding="utf-8")


def scenario_table(text: str, name: str) -> dict[str, Any]:
    """Return the contents of a scenario's TOML ``text``, as a table; a vehicle given by name alone becomes one, too."""
    try:
        table = parse_toml(text)
    except DocumentError as error:
        raise refused(name, error) from error
    if not isinstance(controller := table.get("controller", ""), str):
        raise refused(name, f"controller = {controller!r}: expected a name or a path")
    return _with_named_vehicle(table, name)


def _with_named_vehicle(table: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the ``table`` of a scenario with the vehicle as a table, even if it is given by name alone."""
    vehicle = table.get("vehicle", {})
    if isinstance(vehicle, str):
        vehicle = {"name": vehicle}
    if not isinstance(vehicle, dict):
        raise refused(name, f"vehicle = {vehicle!r}: expected a name, a path, or a table")
    if not isinstance(vehicle.get("name", ""), str):
        raise refused(name, f"vehicle.name = {vehicle['name']!r}: expected a name or a path")
    if not isinstance(vehicle.get("definition") or {}, dict):
        raise refused(name, f"vehicle.definition = {vehicle['definition']!r}: expected the tables of a vehicle file")
    return {**table, "vehicle": vehicle} if vehicle else table


def load_scenario(name: str, changes: Mapping[str, object] | None = None) -> Scenario:
    """Return a scenario by name or path, with ``changes`` of its fields such as ``{"fault[0].start": "90 s"}``.

    Raises:
        ScenarioError: There is no such scenario, or a field is wrong; the message has field, value and expectation.
    """
    return parse_scenario(scenario_text(name, changes), Path(name).stem)


def with_controller(text: str, controller: str, name: str) -> str:
    """Return a scenario's ``text`` with another ``controller``, without the tables of the previous controller."""
    table = scenario_table(text, name)
    kept = {key: value for key, value in table.items() if key not in (*_CONTROLLER_TABLES, *_custom_tables(table))}
    return tomli_w.dumps(kept | {"controller": controller})


def parse_scenario(text: str, name: str) -> Scenario:
    """Return the scenario in a complete TOML ``text`` of :func:`scenario_text`; errors as in :func:`load_scenario`."""
    scenario, drawn = scenario_at_means(scenario_table(text, name), name)
    if drawn:
        field = next(iter(drawn))
        raise refused(name, f"{field}: a distribution, which hsv montecarlo draws; expected a number")
    scenario._text = text
    return scenario


def scenario_at_means(table: dict[str, Any], name: str) -> tuple[Scenario, dict[str, Distribution]]:
    """Return the scenario in ``table`` with distributions replaced by their means, and the distributions by field."""
    complete = table
    vehicle = table.get("vehicle", {})
    if is_path(vehicle.get("name", "")) and "definition" not in vehicle:
        raise refused(name, f"vehicle.name = {vehicle['name']!r}: expected a registered name, or a definition")
    for key in _NO_KEYS:
        if key in table:
            why = ", a scenario is called by its file" if key == "name" else ""
            raise refused(name, f"{key}: unknown key{why}")
    settings = {key: value for key, value in table.items() if key in SETTINGS}
    own = _custom_tables(table)
    table = {key: value for key, value in _with_definition(table, name).items() if key not in (own | settings)}
    vehicle = {"coupling": "", **table.get("vehicle", {})}
    mistakes = Mistakes()
    try:
        reading = Reading(VehicleTable.model_construct(**vehicle).described)
        given = {**table, "name": name, "own": {}, "settings": {}, "limits": {}, "vehicle": vehicle, "requirement": ()}
        with mistakes:
            limits = table_values((*_LIMITS, _DISK_MARGIN), {"limits": table.get("limits", {})})
            given["disk_margin"] = limits.pop(_DISK_MARGIN.name, None)
            given["limits"] = {name.removeprefix("limits."): value for name, value in limits.items()}
        with mistakes:
            given["own"] = {
                key: {k: reading.custom_value(f"{key}.{k}", value) for k, value in entries.items()}
                for key, entries in own.items()
            }
        with mistakes:
            given["settings"] = table_values(_PARAMETERS, settings, reading.number)
        with mistakes:
            given["requirement"] = read_requirements(table.get("requirement", []), table)
        if isinstance(rows := table.get("fault"), list | tuple):
            given["fault"] = [*rows]
            for index, row in enumerate(rows):
                if isinstance(row, dict):
                    given["fault"][index] = {key: row[key] for key in row if key in _FAULT}
                    with mistakes:
                        given["fault"][index] = reading.fault(f"fault[{index}]", row)
        with mistakes:
            scenario = _validated(given, reading)
        mistakes.report()
        _check(scenario, complete)
    except HsvError as error:
        raise refused(name, error) from error
    drawn = reading.drawn
    return scenario, {field: drawn[id(place)] for field, place in tables_in(complete) if id(place) in drawn}


def _validated(given: dict[str, Any], reading: Reading) -> Scenario:
    """Return the scenario with the ``given`` fields; the error for the first wrong one has notes on the others."""
    try:
        return Scenario.model_validate(given, context=reading)
    except ValidationError as error:
        mistakes = Mistakes()
        mistakes.found += (ScenarioError(_in_words(problem)) for problem in error.errors())
        mistakes.report()
        raise


def _shipped() -> Any:
    return files("hsv.flight").joinpath("scenarios")


def _custom_tables(table: dict[str, Any]) -> dict[str, Any]:
    """Return the tables that only a custom controller can read, by name; empty with a shipped controller."""
    if table.get("controller", Scenario.model_fields["controller"].default) in SHIPPED_CONTROLLERS:
        return {}
    known = Scenario.model_fields.keys() | SETTINGS
    return {key: value for key, value in table.items() if isinstance(value, dict) and key not in known}


def _check(scenario: Scenario, tables: Collection[str]) -> None:
    """Refuse a ``scenario`` with fields that are invalid for its vehicle or controller, or contradict each other.

    ``tables`` are the top-level keys of its complete text, inherited ones included.
    """
    mistakes = Mistakes()
    mistakes.found += map(ScenarioError, (*_contradictions(scenario, tables), *_wrong_times(scenario)))
    for index, change in enumerate(scenario.tube.change):
        field = f"tube.change[{index}].tau"
        with mistakes, renamed("parameter ", ""):
            rigid_factors(replace(TAU, name=field).check(change.tau), field)
    for index, fault in enumerate(scenario.fault):
        with mistakes, renamed("fault.", f"fault[{index}]."):
            Fault.of(fault.channel, fault.type, fault.parameters)
    if scenario.settings:
        with mistakes, renamed("parameter ", ""):
            check_equipment(scenario.settings, scenario.vehicle.described.decoupled, PERIOD)
    with mistakes:
        check_envelope(scenario.commands, scenario.command, scenario.vehicle.described)
    mistakes.report()


def _contradictions(scenario: Scenario, tables: Collection[str]) -> Iterator[str]:
    """Yield what in a ``scenario`` does not fit its controller or vehicle; ``tables`` as in :func:`_check`."""
    if not scenario.design and scenario.controller in SHIPPED_CONTROLLERS:
        yield f"design = '': expected one, {scenario.controller} flies with its gains"
    for name, value in scenario.vehicle.perturbation.items():
        if name not in scenario.vehicle.described.uncertainty:
            expected = one_of(scenario.vehicle.described.uncertainty, name)
            yield f"vehicle.perturbation.{name} = {value}: no such parameter, expected {expected}"
    for table, controller in _CONTROLLER_TABLES.items():
        if table in tables and scenario.controller != controller:
            yield f"{table}: {scenario.controller} does not read it, expected controller {controller}"
    if "nominal" in tables and scenario.controller == "robust_mpc":
        yield "nominal: robust_mpc does not read it, expected one that follows the nominal state"
    for index, command in enumerate(scenario.command):
        if not {"altitude_change", "velocity_change"} & command.model_fields_set:
            yield f"command[{index}]: changes nothing, expected altitude_change or velocity_change"


def _wrong_times(scenario: Scenario) -> Iterator[str]:
    """Yield events that start too late, simultaneous changes of tau, and faults that stop at or before their start.

    Commands, changes of tau, faults and gusts must start before the flight's end, but may last beyond it. A start at
    0 s is always accepted.
    """
    changes = [change.start for change in scenario.tube.change]
    starts = {
        "command[{}].start": [command.start for command in scenario.command],
        "tube.change[{}].start": changes,
        "fault[{}].start": [fault.start for fault in scenario.fault],
        "gust.starts[{}]": scenario.settings.get("gust.starts", ()),
    }
    for field, times in starts.items():
        for index, start in enumerate(times):
            if start > 0.0 and start >= scenario.duration:
                end = f"the flight's end, {scenario.duration:g} s"
                yield f"{field.format(index)} = {start:g} s: expected a time before {end}"
    for index, start in enumerate(changes):
        if start in changes[:index]:
            yield f"tube.change[{index}].start = {start:g} s: expected one change at a time"
    for index, fault in enumerate(scenario.fault):
        if fault.stop is not None and fault.stop <= fault.start:
            given = f"fault[{index}].stop = {fault.stop:g} s"
            yield f"{given}: expected a time after its start, {fault.start:g} s"


_DUE = {
    "tuple_type": "a list of tables",
    "model_type": "a table",
    "string_type": "a text",
    "string_pattern_mismatch": "a text that is not empty",
    "int_type": "a whole number",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
}
"""Expected values in words, by pydantic's type of error; for other types, pydantic's own message is used."""


def _in_words(problem: Mapping[str, Any]) -> str:
    """Return one of pydantic's errors as text."""
    field = dotted(problem["loc"])
    if problem["type"] == "extra_forbidden":
        return f"{field}: unknown key, expected {one_of(_siblings(problem['loc']), str(problem['loc'][-1]))}"
    if problem["type"] == "missing":
        return f"{field}: missing"
    if problem["type"] == "value_error":
        # The message begins with the name of the field alone; replace it by the full path.
        _, equals, rest = str(problem["ctx"]["error"]).partition(" = ")
        return f"{field}{equals}{rest}"
    due = _DUE.get(problem["type"]) or problem["msg"].removeprefix("Input should be ")
    return f"{field} = {problem['input']!r}: expected {due.format(**problem.get('ctx', {}))}"


def _siblings(location: tuple[int | str, ...]) -> list[str]:
    model: Any = Scenario
    for part in location[:-1]:
        if isinstance(part, str):
            annotation = model.model_fields[part].annotation
            model = annotation if isinstance(annotation, type) else annotation.__args__[0]
    if model is Scenario:
        return [name for name in (*model.model_fields, *sorted(SETTINGS)) if name not in _NO_KEYS]
    return list(model.model_fields)
