"""The layout for Foxglove and Lichtblick: the vehicle in 3-D, and the panels of the report as plots in tabs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

from hsv.bags.description import ACTUATOR, COMMAND, DIAGNOSTICS, ROSOUT, TUBE_STATUS
from hsv.model.signals import N_RIGID
from hsv.pages.airframe.pose import LEVEL, Sample, transforms
from hsv.pages.airframe.scene import SCENE_TOPIC
from hsv.pages.panels import GROUPS, PANELS, Panel, error_panel

COLOURS = ("#0072b2", "#d55e00", "#57606a")


def foxglove_layout(name_of: Callable[[str], str]) -> str:
    """Return the layout for Foxglove and Lichtblick as JSON text.

    Args:
        name_of: Function that maps the default name of a topic to its name in the displayed graph.
    """
    settings: dict[str, Any] = {}

    def placed(kind: str, values: dict[str, Any]) -> str:
        name = f"{kind}!hsv{len(settings):02d}"
        settings[name] = values
        return name

    def path(label: str, role: str, field: str) -> dict[str, Any]:
        return {"value": f"{name_of(role)}.{field}", "label": label, "enabled": True, "timestampMethod": "headerStamp"}

    def plot(panel: Panel) -> str:
        # Viewers cannot add fields: draw centre and half-width of the tube instead of its bounds, and omit other sums.
        fields = {}
        for curve in panel.curves:
            for field in curve.fields if len(curve.fields) == 1 or panel.group == "tube" else ():
                name, index = field.removeprefix("-"), "" if curve.column is None else f"[{curve.column}]"
                fields[name] = path(curve.label if len(curve.fields) == 1 else name, curve.topic, name + index)
        look = {"showLine": True, "lineSize": 1.2}
        paths = [found | look | {"color": colour} for found, colour in zip(fields.values(), COLOURS, strict=False)]
        title = f"{panel.title} [{'-' if panel.unit == '1' else panel.unit}]"
        shown = ("isSynced", "showLegend", "showPlotValuesInLegend", "showXAxisLabels", "showYAxisLabels")
        values = {"title": title, "paths": paths, "xAxisVal": "timestamp", "legendDisplay": "top"}
        return placed("Plot", values | dict.fromkeys(shown, True))

    def rows(panels: Sequence[Panel]) -> Any:
        """Return the layout of plots: up to three in a column, more in rows of two."""
        across = 1 if len(panels) <= 3 else 2
        starts = range(0, len(panels), across)
        return _split("column", [_split("row", list(map(plot, panels[at : at + across]))) for at in starts])

    changing = [
        path("first active fault", ACTUATOR, "active[0].type"),
        path("inside the tube", TUBE_STATUS, "inside"),
        path("fuel limited", COMMAND, "saturated[0]"),
        path("elevator limited", COMMAND, "saturated[1]"),
    ]
    states = placed("StateTransitions", {"isSynced": True, "showPoints": False, "paths": changing})
    rigid = _split("column", list(map(plot, PANELS[:N_RIGID])))
    flight = _split("row", [placed("3D", _airframe()), rigid], first=62.0)
    log = placed("RosOut", {"topicToRender": ROSOUT, "searchTerms": [], "minLogLevel": 1})
    diagnostics = placed("DiagnosticSummary", {"topicToRender": name_of(DIAGNOSTICS), "minLevel": 0})
    panels = (*PANELS, *map(error_panel, range(N_RIGID)))
    grouped = {heading: [panel for panel in panels if panel.group == group] for group, heading in GROUPS.items()}
    tabs = {
        "Flight": _split("column", [flight, states], first=80.0),
        **{heading: rows(found) for heading, found in grouped.items() if found},
        "Messages": _split("column", [log, diagnostics]),
    }
    listed = [{"title": title, "layout": layout} for title, layout in tabs.items()]
    tab = placed("Tab", {"activeTabIdx": 0, "tabs": listed})
    layout = {"configById": settings, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return json.dumps(layout | {"layout": tab}, indent=1)


def _split(direction: str, parts: list[Any], first: float = 0.0) -> Any:
    """Return the layout of ``parts`` in a row or column, of equal size or with ``first`` percent for the first."""
    if len(parts) == 1:
        return parts[0]
    share = first or round(100.0 / len(parts), 3)
    rest = _split(direction, parts[1:])
    return {"direction": direction, "first": parts[0], "second": rest, "splitPercentage": share}


def _airframe() -> dict[str, Any]:
    """Return the settings of the 3-D panel, which follows the vehicle and hides the axes of all frames."""
    moving = transforms(Sample(*[0.0] * len(Sample.__annotations__)))
    frames = dict.fromkeys(end for transform in moving for end in (transform.parent, transform.child))
    grid = {
        "layerId": "foxglove.Grid",
        "instanceId": "grid",
        "label": "Horizon",
        "visible": True,
        "frameId": LEVEL,
        "frameLocked": True,
        "size": 80,
        "divisions": 16,
        "color": "#8c959f66",
        "position": [0, 0, -6],
    }
    camera = {
        "perspective": True,
        "distance": 46,
        "phi": 74,
        "thetaOffset": 24,
        "targetOffset": [-1, 0, 0],
        "far": 5000,
    }
    return {
        "cameraState": camera,
        "followMode": "follow-pose",
        "followTf": LEVEL,
        "scene": {"transforms": {"showLabel": False, "enablePreloading": False}},
        "transforms": {f"frame:{frame}": {"visible": False} for frame in frames},
        "topics": {SCENE_TOPIC: {"visible": True}},
        "layers": {"grid": grid},
    }
