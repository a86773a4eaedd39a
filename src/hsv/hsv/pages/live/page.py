"""The live page: the plots of the report for a running flight, with the controls of that flight."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from hsv.base.units import UnitSystem
from hsv.graph.exclusive import origins
from hsv.model.faults.table import CHANNELS, FAULT_KINDS
from hsv.pages.engine import Plot, render
from hsv.pages.live.hub import Hub
from hsv.pages.panels import GROUPS, LIVE_CURVES
from hsv.pages.side_view import geometry

BESIDE = ("altitude", "elevator_deflection", "level")
"""Panels next to the vehicle, which a screen shows without scrolling."""


def live_page(hub: Hub, port: int) -> str:
    """Return the HTML page for the flight of ``hub``, served on ``port``."""
    plots = []
    for panel, numbered in groupby(enumerate(LIVE_CURVES, 1), lambda numbered: numbered[1][0]):
        # The page's script keeps the rows of the flight as arrays: array 0 is the time, the curves follow.
        curves = [{"kind": c.kind, "label": c.label, "run": 0, "x": 0, "y": number} for number, (_, c) in numbered]
        group = "now" if panel.name in BESIDE else panel.group
        plots.append(Plot(panel.name, panel.title, panel.unit, group, curves))
    groups = {key: heading for key, heading in GROUPS.items() if any(plot.group == key for plot in plots)}
    return render(
        "live.html.j2",
        plots=plots,
        described={"runs": [{"label": "flight", "end": 1.0, "faults": []}], "airframe": geometry(), "kinds": _kinds()},
        title=hub.status()["title"] or "Flight",
        sockets=" ".join(origin.replace("http", "ws", 1) for origin in origins(port)),
        units=UnitSystem.metric,
        groups=groups,
        sections={"vehicle": "Vehicle", **groups, "diagnostics": "Diagnostics"},
        airframe=geometry(),
    )


def _kinds() -> dict[str, dict[str, Any]]:
    """Return the fault types for the page's form, by channel and type, with the ranges of their parameters."""
    found: dict[str, dict[str, Any]] = {channel: {} for channel in CHANNELS}
    for name, kind in FAULT_KINDS.items():
        for channel in kind.channels:
            parameters = [
                {
                    "name": p.name,
                    "range": f"{p.of(channel).minimum:.6g} to {p.of(channel).maximum:.6g} {p.of(channel).unit}".strip(),
                    "due": p.default is None,
                }
                for p in kind.parameters
            ]
            found[channel][name] = {"meaning": kind.meaning, "parameters": parameters}
    return found
