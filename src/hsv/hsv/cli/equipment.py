"""The command ``hsv equipment``."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any

import typer

from hsv.base.units import UnitSystem, in_system
from hsv.cli.options import ListJsonOption, UnitsOption
from hsv.cli.output import console, folded, json_system, print_json, print_rows


def equipment(
    name: Annotated[str, typer.Argument(help="Set whose numbers to print; default: list all.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: ListJsonOption = False,
) -> None:
    """List the published sets of actuators and sensors that a scenario can name, or print the numbers of one.

    Example: hsv equipment elevator_50 --units paper
    """
    from hsv.base.errors import ParameterError, did_you_mean

    sets = _sets(json_system(units) if json else units)
    if name and name not in sets:
        raise ParameterError(f"name = {name!r}: expected one of {', '.join(sets)}{did_you_mean(name, sets)}")
    if json:
        print_json({"name": name, **sets[name]} if name else sets)
    elif name:
        console.print(folded(f"{name}: {sets[name]['source']}"), soft_wrap=True)
        console.print(f'in a scenario: [{sets[name]["table"]}] set = "{name}"', soft_wrap=True)
        if sets[name]["numbers"]:
            print_rows(sets[name]["numbers"])
    else:
        print_rows([{"set": key, "table": entry["table"], "source": entry["source"]} for key, entry in sets.items()])


def _sets(units: UnitSystem) -> dict[str, dict[str, Any]]:
    """Return the sets by name: the table of a scenario that may name them, their source and numbers."""
    from hsv.base.parameters import Parameter
    from hsv.model.actuators import ACTUATOR_SETS
    from hsv.model.plant import EQUIPMENT_PARAMETERS
    from hsv.model.sensors import SENSOR_SETS

    declared: dict[str, Parameter] = {parameter.name: parameter for parameter in EQUIPMENT_PARAMETERS}

    def number(channel: str, quantity: str, value: float, table: str) -> dict[str, Any]:
        # The paper has angles in degrees, but natural frequencies in rad/s.
        system = UnitSystem.si if quantity == "natural_frequency" else units
        value, unit = in_system(value, declared[f"{table}.{quantity}"].unit, system)
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
