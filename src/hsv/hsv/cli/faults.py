"""The command ``hsv faults``."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from hsv.base.units import UnitSystem, in_system
from hsv.cli.options import ListJsonOption, UnitsOption
from hsv.cli.output import console, folded, json_system, print_json, print_rows


def faults(
    type: Annotated[str, typer.Argument(help="Type of fault whose parameters to print; default: list all.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: ListJsonOption = False,
) -> None:
    """List the types of faults, or print the parameters of one: units, ranges, defaults.

    Example: hsv faults oscillation --units paper
    """
    from hsv.base.errors import ParameterError, did_you_mean
    from hsv.model.faults.table import FAULT_KINDS

    if type and type not in FAULT_KINDS:
        raise ParameterError(
            f"type = {type!r}: expected one of {', '.join(FAULT_KINDS)}{did_you_mean(type, FAULT_KINDS)}"
        )
    kinds: dict[str, dict[str, Any]] = {
        name: {"side": kind.side, "channels": list(kind.channels), "meaning": kind.meaning}
        for name, kind in FAULT_KINDS.items()
    }
    if type:
        parameters = _parameters(type, json_system(units) if json else units)
        if json:
            print_json({"type": type, **kinds[type], "parameters": parameters})
            return
        console.print(folded(f"{type}: {kinds[type]['meaning']}"), soft_wrap=True)
        side = f"side: {kinds[type]['side']}; channels: {_listed(kinds[type]['channels'])}"
        console.print(folded(side), soft_wrap=True)
        print_rows([_row(**parameter) for parameter in parameters])
    elif json:
        print_json(kinds)
    else:
        print_rows(
            [
                {
                    "type": name,
                    "side": kind["side"],
                    "channels": _listed(kind["channels"]),
                    "meaning": kind["meaning"],
                }
                for name, kind in kinds.items()
            ]
        )


def _listed(channels: list[str]) -> str:
    from hsv.model.dynamics import STATE_NAMES

    return "every state" if channels == list(STATE_NAMES) else ", ".join(channels)


def _row(parameter: str, channel: str, **others: Any) -> dict[str, Any]:
    """Return a row of the table, in which one column holds a parameter and its channel."""
    return {"parameter": f"{parameter} of {channel}" if channel else parameter, **others}


def _parameters(type: str, units: UnitSystem) -> list[dict[str, Any]]:
    """Return a row a parameter, and one a channel where its unit is the channel's."""
    from hsv.model.faults.table import FAULT_KINDS, fault_parameters

    rows = []
    channels = FAULT_KINDS[type].channels
    for parameter in fault_parameters(channels[0], type):
        own = "{}" in parameter.unit
        for channel in channels if own else channels[:1]:
            described = parameter.of(channel)
            # The paper has angles in degrees, but natural frequencies in rad/s.
            system = units if own or parameter.unit != "rad/s" else UnitSystem.si
            ends = [in_system(end, described.unit, system) for end in (described.minimum, described.maximum)]
            (least, unit), (largest, _) = ends
            default = parameter.default
            rows.append(
                {
                    "parameter": parameter.name,
                    "channel": channel if own else "",
                    "least": least,
                    "largest": largest,
                    "default": None if default is None else in_system(default, described.unit, system)[0],
                    "unit": unit,
                    "meaning": parameter.description,
                }
            )
    return rows
