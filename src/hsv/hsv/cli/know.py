"""Commands that list what there is, check whether a controller is reproducible, and measure this machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import StrEnum
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text
from typer import Argument, Option

from hsv.base.errors import HsvError, ParameterError, QuantityError, RunError, one_of
from hsv.base.units import UnitSystem, in_system
from hsv.cli import output
from hsv.cli.options import JsonOption, ListJsonOption, UnitsOption

if TYPE_CHECKING:
    from hsv.cli.bench import Figure


_FLOWN = {"room, fuel": "1", "room, elevator": "rad", "largest level": "1", "disk margin": "1"}
"""Least distance of the nominal inputs from the bounds of U minus F Z, largest tube level of the flights of a design,
and disk margin of its elevator loop at the worst vertex."""


class Kind(StrEnum):
    """Kinds of things that can be listed."""

    scenarios = "scenarios"
    vehicles = "vehicles"
    faults = "faults"
    equipment = "equipment"
    controllers = "controllers"
    designs = "designs"
    bags = "bags"


def list_(
    kind: Annotated[Kind, Argument(help="What to list.", metavar="|".join(Kind))],
    name: Annotated[str, Argument(help="Print this one; a file, or of bags their folder.")] = "",
    metric: Annotated[list[str] | None, Option(help="Of bags: a metric to list, repeatable.")] = None,
    csv: Annotated[Path | None, Option(help="Of bags: write the table, in SI, to this file.")] = None,
    units: UnitsOption = UnitSystem.metric,
    json: ListJsonOption = False,
) -> None:
    """List scenarios, vehicles, faults, equipment, controllers, designs, the bags of a folder; or print one.

    A scenario or vehicle is printed with everything that it inherits from the one it extends, a fault with the units,
    ranges and defaults of its parameters, equipment with its numbers and source. Designs are listed with what their
    certificates state, bags with scenario, time, verdict, fingerprint and the metrics that you name.

    Example: hsv list scenarios case2_derived
    """
    system = output.json_system(units) if json else units
    if kind is Kind.scenarios:
        _list_scenarios(name, json)
    elif kind is Kind.vehicles:
        _list_vehicles(name, json)
    elif kind is Kind.faults:
        _list_faults(name, system, json)
    elif kind is Kind.equipment:
        _list_equipment(name, system, json)
    elif kind is Kind.bags:
        from hsv.cli.bag_list import list_bags

        list_bags(Path(name or "bags"), metric or (), csv, units, json)
    elif kind is Kind.designs:
        _list_designs(name, system, json)
    else:
        _list_controllers(name, json)


def _known(kind: Kind, name: str, names: Mapping[str, Any]) -> None:
    if name and name not in names:
        raise ParameterError(f"{kind.removesuffix('s')} = {name!r}: expected {one_of(names, name)}")


def _list_scenarios(name: str, json: bool) -> None:
    from hsv.flight.scenario import load_scenario, scenario_at_means, scenario_names, scenario_table, scenario_text

    if not name:
        output.print_titles({name: load_scenario(name).title for name in scenario_names()}, json)
        return
    text, stem = scenario_text(name), Path(name).stem
    table = scenario_table(text, stem)
    scenario_at_means(table, stem)
    output.print_json(table) if json else print(text, end="")


def _list_vehicles(name: str, json: bool) -> None:
    from hsv.model.vehicle import load_vehicle, vehicle_names, vehicle_tables, vehicle_text

    if not name:
        output.print_titles({name: load_vehicle(name).title for name in vehicle_names()}, json)
    elif json:
        vehicle_text(name)
        output.print_json(vehicle_tables(name))
    else:
        print(vehicle_text(name), end="")


def _list_designs(name: str, units: UnitSystem, json: bool) -> None:
    from hsv.cli.design import HALF_WIDTHS
    from hsv.control.design_file import certificate_path, design_names, find_design, read_certificate

    names = design_names()
    _known(Kind.designs, name, dict.fromkeys(names))
    sets, flown = [], []
    for known in [name] if name else names:
        certificate = read_certificate(certificate_path(find_design(known)))
        tube, margin = certificate["tube"], min(certificate["margins"]["vertices"]["elevator"]["margin"])
        plan = tube["tightening"]["plan"]
        sets.append((known, [*tube["invariant_set"]["half_width"][:5], *tube["invariant_set"]["feedback_half_range"]]))
        room = map(min, plan["margin_to_lower"], plan["margin_to_upper"])
        flown.append((known, [*room, tube["flights"]["worst_level"], margin]))
    if json:
        units_of = {key.replace(", ", "_").replace(" ", "_"): unit for key, unit in (HALF_WIDTHS | _FLOWN).items()}
        stated = {}
        for (known, row), (_, others) in zip(sets, flown, strict=True):
            pairs = zip(units_of.items(), row + others, strict=True)
            stated[known] = output.to_json({key: (value, unit) for (key, unit), value in pairs}, units)
        output.print_json(stated)
        return
    output.console.print(output.quantity_table("Half-widths of the invariant sets, given W", HALF_WIDTHS, sets, units))
    output.console.print(output.quantity_table("Room of the plan, flights, and elevator loop", _FLOWN, flown, units))


def _list_controllers(name: str, json: bool) -> None:
    from hsv.plugins.controllers import controller_class, controller_names

    titles = {}
    for known in controller_names():
        try:
            description = (controller_class(known).__doc__ or "").strip().partition("\n")[0]
        except HsvError as error:
            description = str(error)  # a package that is installed but cannot be loaded
        titles[known] = description
    _known(Kind.controllers, name, titles)
    output.print_titles({name: titles[name]} if name else titles, json)


def _list_faults(name: str, units: UnitSystem, json: bool) -> None:
    from hsv.model.faults.table import FAULT_KINDS
    from hsv.model.signals import STATE_NAMES

    _known(Kind.faults, name, FAULT_KINDS)
    kinds: dict[str, dict[str, Any]] = {
        name: {
            "side": kind.side,
            "channels": list(kind.channels),
            "parameters": [parameter.name for parameter in kind.parameters],
            "meaning": kind.meaning,
        }
        for name, kind in FAULT_KINDS.items()
    }
    channels = {
        name: "every state" if kind["channels"] == list(STATE_NAMES) else ", ".join(kind["channels"])
        for name, kind in kinds.items()
    }
    if name:
        parameters = list(_fault_parameters(name, units))
        if json:
            output.print_json({"type": name, **kinds[name], "parameters": parameters})
            return
        output.say(output.folded(f"{name}: {kinds[name]['meaning']}"))
        output.say(output.folded(f"side: {kinds[name]['side']}; channels: {channels[name]}"))
        for row in parameters:
            # One column holds a parameter and its channel.
            channel = row.pop("channel")
            row["parameter"] += f" of {channel}" if channel else ""
        output.print_rows(parameters)
    elif json:
        output.print_json(kinds)
    else:
        rows = []
        for name, kind in kinds.items():
            own = ", ".join(kind.pop("parameters"))
            kind["meaning"] += f" (parameters: {own})" if own else ""
            rows.append({"type": name, **kind, "channels": channels[name]})
        output.print_rows(rows)


def _fault_parameters(type: str, units: UnitSystem) -> Iterator[dict[str, Any]]:
    """Yield a row for each parameter of a fault type, or one for each channel if the unit depends on the channel."""
    from hsv.model.faults.table import FAULT_KINDS, fault_parameters

    channels = FAULT_KINDS[type].channels
    for parameter in fault_parameters(channels[0], type):
        own = "{}" in parameter.unit
        for channel in channels if own else channels[:1]:
            described = parameter.of(channel)
            # The paper has angles in degrees, but natural frequencies in rad/s.
            system = units if own or parameter.unit != "rad/s" else UnitSystem.si
            least, largest, default = (
                None if value is None else in_system(value, described.unit, system)[0]
                for value in (described.minimum, described.maximum, parameter.default)
            )
            yield {
                "parameter": parameter.name,
                "channel": channel if own else "",
                "least": least,
                "largest": largest,
                "default": default,
                "unit": in_system(1.0, described.unit, system)[1],
                "meaning": parameter.description,
            }


def _list_equipment(name: str, units: UnitSystem, json: bool) -> None:
    sets = _equipment_sets(units)
    _known(Kind.equipment, name, sets)
    if json:
        output.print_json({"name": name, **sets[name]} if name else sets)
    elif name:
        output.say(
            output.folded(f"{name}: {sets[name]['source']}"), f'in a scenario: [{sets[name]["table"]}] set = "{name}"'
        )
        if sets[name]["numbers"]:
            output.print_rows(sets[name]["numbers"])
    else:
        output.print_rows(
            [{"set": key, "table": entry["table"], "source": entry["source"]} for key, entry in sets.items()]
        )


def _equipment_sets(units: UnitSystem) -> dict[str, dict[str, Any]]:
    """Return the equipment sets by name, each with the scenario table that can name it, its source and its numbers."""
    from hsv.model.actuators import ACTUATOR_SETS
    from hsv.model.plant import EQUIPMENT_PARAMETERS
    from hsv.model.sensors import SENSOR_SETS

    si = {parameter.name: parameter.unit for parameter in EQUIPMENT_PARAMETERS}

    def number(channel: str, quantity: str, value: float, table: str) -> dict[str, Any]:
        # The paper has angles in degrees, but natural frequencies in rad/s.
        system = UnitSystem.si if quantity == "natural_frequency" else units
        value, unit = in_system(value, si[f"{table}.{quantity}"], system)
        return {"channel": channel, "quantity": quantity, "value": value, "unit": unit}

    sets = {}
    for name, actuator in ACTUATOR_SETS.items():
        table = f"actuator.{actuator.channel}"
        fields = ["order", "natural_frequency", "damping_ratio", "stop", "rate_limit"]
        given = {field: getattr(actuator, field) for field in fields if actuator.order > 1 or field != "damping_ratio"}
        numbers = [number(actuator.channel, *pair, table) for pair in given.items() if isfinite(pair[1])]
        sets[name] = {"table": table, "source": actuator.source, "numbers": numbers}
    for name, sensors in SENSOR_SETS.items():
        numbers = [
            number(channel, quantity, value, f"sensors.{channel}")
            for channel, fields_of_channel in sensors.channels.items()
            for quantity, value in fields_of_channel.items()
        ]
        if sensors.inertial_angle_of_attack:
            numbers.append({"channel": "", "quantity": "inertial_angle_of_attack", "value": 1.0, "unit": ""})
        sets[name] = {"table": "sensors", "source": sensors.source, "numbers": numbers}
    return sets


def check(
    flown: Annotated[str, Argument(metavar="CONTROLLER|SCENARIO", help="A controller, flown in case1, or a scenario.")],
    json: JsonOption = False,
) -> None:
    """Check that a controller is reproducible: fly it twice, after a reset, from a copied state and under load.

    Every byte is compared. On a difference, the first step and number that differ are printed, and the exit code is 1.

    Example: hsv check tube_mpc
    """
    from hsv.flight.repeatability import findings, scenario_of

    scenario = scenario_of(flown)
    found = []
    with output.stages() as progress:
        for finding in findings(scenario):
            found.append(finding)
            progress(scenario.controller, len(found), 4)
    failing = [finding for finding in found if finding.difference]
    if json:
        checks = [vars(f) | {"same": None if f.not_checked else not f.difference} for f in found]
        output.print_json(
            {"controller": scenario.controller, "scenario": scenario.name, "ok": not failing, "checks": checks}
        )
    else:
        title = f"{scenario.controller} in {scenario.name}"
        table = output.new_table("check", "flights", "bytes", title=title, right=["flights"])
        for finding in found:
            style = "bold red" if finding.difference else None
            result = f"not checked: {finding.not_checked}" if finding.not_checked else finding.difference or "the same"
            table.add_row(finding.check, str(finding.flights), result, style=style)
        output.console.print(table)
    if failing:
        output.report_error(f"{scenario.controller}, {failing[0].check}: {failing[0].difference}")
        raise typer.Exit(1)


def bench(
    only: Annotated[list[str] | None, Option(help="Measure only this group; can be repeated.")] = None,
    scale: Annotated[float, Option(help="Factor on the number of repetitions.")] = 1.0,
    json: JsonOption = False,
) -> None:
    """Measure the performance of this machine, as ratios of two run times that are measured in alternation.

    The exit code is 1 if a ratio is worse than its limit, or if a group of --only could not be measured.

    Example: hsv bench --only in_process --only startup
    """
    from hsv.cli.bench import groups, machine, readable
    from hsv.graph.preparation import commit

    if not 0.0 < scale <= 100.0:
        raise QuantityError(f"scale = {scale}: expected above 0, at most 100")
    available = groups(scale)
    for name in only or ():
        if name not in available:
            raise QuantityError(f"only = {name!r}: expected {one_of(available, name)}")
    chosen = [name for name in available if not only or name in only]
    measured: dict[str, list[Figure]] = {}
    skipped: dict[str, str] = {}
    with output.stages() as progress:
        for number, name in enumerate(chosen):
            progress("measuring", number, len(chosen))
            try:
                measured[name] = available[name]()
            except RunError as error:
                # Without a compiler or a built workspace, the rest can still be measured.
                skipped[name] = str(error)
    figures = {figure.name: figure for found in measured.values() for figure in found}
    if json:
        described = [figure.as_dict(group) for group, found in measured.items() for figure in found]
        output.print_json({"commit": commit(), "machine": machine(), "figures": described, "skipped": skipped})
    else:
        for figure in figures.values():
            ours, theirs = (readable(sorted(times)[len(times) // 2]) for times in (figure.ours, figure.theirs))
            low, high = figure.spread
            output.say(Text(output.folded(figure.what), "bold"))
            ratio = f"ratio {figure.ratio:.3g} ({low:.3g} to {high:.3g})"
            output.say(output.folded(f"{ours} against {theirs} of {figure.against}: {ratio}", 4, first=4))
            promise = "; ".join(filter(None, (figure.verdict, figure.note)))
            output.say(Text(output.folded(promise, 4, first=4), "bold red" if "WORSE" in promise else ""))
        if not only:
            for name, reason in skipped.items():
                output.errors.print(f"{name}: not measured: {reason}", soft_wrap=True)
    if only and skipped:
        raise RunError("; ".join(f"only = {name!r}: not measured: {reason}" for name, reason in skipped.items()))
    if worse := [f"{name} {figure.ratio:.3g}, {figure.verdict}" for name, figure in figures.items() if figure.worse]:
        raise RunError("; ".join(worse))
