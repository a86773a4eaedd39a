"""The live page: what the report draws, of a flight that is on its way, with the controls of that flight."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from markupsafe import Markup

from hsv.base.parameters import Parameter
from hsv.base.units import UnitSystem
from hsv.graph.addresses import origins
from hsv.model.airframe import side_view
from hsv.model.faults.table import CHANNELS, FAULT_KINDS
from hsv.pages.live.hub import Hub
from hsv.pages.report.panels import GROUPS
from hsv.pages.report.templates import LIBRARY, asset, environment_of
from hsv.pages.report.text import units_of


def render(hub: Hub, port: int) -> str:
    """Return the page of a flight that ``hub`` knows, as it is served on ``port``."""
    panels = list(dict.fromkeys(column.panel for column in hub.columns))
    environment = environment_of("hsv.pages.live")
    environment.policies["json.dumps_kwargs"] = {}  # in the order of the tables
    template = environment.get_template("live.html.j2")
    return template.render(
        title=hub.status()["title"],
        groups={key: heading for key, heading in GROUPS.items() if any(panel.group == key for panel in panels)},
        panels=panels,
        kinds=_kinds(),
        sockets=" ".join(origin.replace("http", "ws", 1) for origin in origins(port)),
        units=UnitSystem.metric,
        styles=[asset("style.css"), asset("live.css", "hsv.pages.live")],
        scripts=[
            Markup(LIBRARY.read_text(encoding="utf-8")),
            asset("charts.js"),
            Markup(side_view.script()),
            asset("live.js", "hsv.pages.live"),
        ],
        plots={"panels": _panels(hub)},
        airframe=side_view.geometry(),
    )


def _panels(hub: Hub) -> list[dict[str, Any]]:
    """Return the panels as :mod:`hsv.pages.report.payload` describes them; x is array 0, the columns follow."""
    described = []
    for panel, columns in groupby(enumerate(hub.columns, 1), lambda numbered: numbered[1].panel):
        described.append(
            {
                "name": panel.name,
                "units": units_of(panel.unit),
                "curves": [
                    {"kind": column.kind, "label": column.label, "run": 0, "x": 0, "y": number}
                    for number, column in columns
                ],
                "limits": [1.0] if panel.name == "level" else [],
                "shades": [],
            }
        )
    return described


def _kinds() -> dict[str, dict[str, Any]]:
    """Return what the form of faults offers: the types of fault by channel, with parameters as they are written."""
    return {
        channel: {
            name: {
                "meaning": kind.meaning,
                "parameters": [
                    {
                        "name": parameter.name,
                        "range": _range(parameter.of(channel)),
                        "due": parameter.default is None,
                    }
                    for parameter in kind.parameters
                ],
            }
            for name, kind in FAULT_KINDS.items()
            if channel in kind.channels
        }
        for channel in CHANNELS
    }


def _range(parameter: Parameter) -> str:
    return f"{parameter.minimum:.4g} to {parameter.maximum:.4g} {parameter.unit}".strip()
