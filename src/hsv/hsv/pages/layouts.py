"""The layout for Foxglove and Lichtblick: the vehicle in 3-D, and the panels of the report as plots in tabs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

from hsv.bags.description import (
    ACTUATOR,
    COMMAND,
    DIAGNOSTICS,
    FORCES,
    MARKERS,
    NOMINAL,
    ROSOUT,
    TUBE_STATUS,
    resolved,
)
from hsv.model.airframe.pose import LEVEL, Sample, transforms
from hsv.model.airframe.scene import SCENE_TOPIC
from hsv.model.signals import N_RIGID
from hsv.pages.panels import ERRORS, GROUPS, PANELS, Curve, Kind, Panel, error_panel

COLOURS = ("#0072b2", "#d55e00", "#57606a")

FORCE_PANELS = (
    ("Lift, drag, thrust", "N", ("lift", "drag", "thrust")),
    ("Pitching moment", "N m", ("pitching_moment",)),
    ("Dynamic pressure", "Pa", ("dynamic_pressure",)),
)
"""Title, unit and fields of the plots of forces."""


def _tabs() -> dict[str, list[Panel]]:
    """Return the plots by the title of their tab."""
    tabs: dict[str, list[Panel]] = {heading: [] for heading in GROUPS.values()}
    for panel in PANELS:
        tabs[GROUPS[panel.group]].append(panel)
        if panel.group == "trajectory":
            deviation = Curve(Kind.nominal, "nominal", NOMINAL, (f"deviation.{panel.name}",))
            title = f"{panel.title}, deviation of the nominal"
            tabs[GROUPS["trajectory"]].append(Panel(panel.name, title, panel.unit, panel.group, (deviation,)))
    for component in range(len(ERRORS)):
        error = error_panel(component)
        tube = {"c": "tube_centre", "z": "tube_half_width"}
        more = (Curve(Kind.bound, label, TUBE_STATUS, (field,), component) for label, field in tube.items())
        curves = (error.curves[0], *more)
        tabs[GROUPS["tube"]].append(Panel(error.name, error.title, error.unit, error.group, curves))
    tabs["Forces"] = [
        Panel(
            title, title, unit, "forces", tuple(Curve(Kind.actual, f.replace("_", " "), FORCES, (f,)) for f in fields)
        )
        for title, unit, fields in FORCE_PANELS
    ]
    return {title: panels for title, panels in tabs.items() if panels}


def foxglove_layout(name_of: Callable[[str], str]) -> str:
    """Return the layout as JSON.

    Args:
        name_of: Function that returns the name of the topic of a role in the graph that is shown.
    """
    settings: dict[str, Any] = {}

    def placed(kind: str, values: dict[str, Any]) -> str:
        name = f"{kind}!hsv{len(settings):02d}"
        settings[name] = values
        return name

    def path(label: str, role: str, field: str) -> dict[str, Any]:
        return {"value": f"{name_of(role)}.{field}", "label": label, "enabled": True, "timestampMethod": "headerStamp"}

    def plot(panel: Panel) -> str:
        # Viewers do not add fields.
        single = [curve for curve in panel.curves if len(curve.fields) == 1]
        paths = []
        for curve, colour in zip(single, COLOURS, strict=False):
            field = curve.fields[0] if curve.column is None else f"{curve.fields[0]}[{curve.column}]"
            look = {"color": colour, "showLine": True, "lineSize": 1.2}
            paths.append(path(curve.label, curve.topic, field) | look)
        title = f"{panel.title} [{'-' if panel.unit == '1' else panel.unit}]"
        shown = ("isSynced", "showLegend", "showPlotValuesInLegend", "showXAxisLabels", "showYAxisLabels")
        values = {"title": title, "paths": paths, "xAxisVal": "timestamp", "legendDisplay": "top"}
        return placed("Plot", values | dict.fromkeys(shown, True))

    def rows(panels: Sequence[Panel]) -> Any:
        """Place up to three plots in a column, or more in rows of two."""
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
    diagnostics = {"topicToRender": name_of(DIAGNOSTICS), "minLevel": 0, "pinnedIds": [], "hardwareIdFilter": ""}
    below = [
        placed("DiagnosticSummary", diagnostics | {"sortByLevel": True}),
        placed("RawMessages", {"topicPath": name_of(ACTUATOR), "diffEnabled": False}),
    ]
    tabs = {
        "Flight": _split("column", [flight, states], first=80.0),
        **{title: rows(panels) for title, panels in _tabs().items()},
        "Messages": _split("column", [log, _split("row", below)]),
    }
    listed = [{"title": title, "layout": layout} for title, layout in tabs.items()]
    tab = placed("Tab", {"activeTabIdx": 0, "tabs": listed})
    layout = {"configById": settings, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return json.dumps(layout | {"layout": tab}, indent=1)


def _split(direction: str, parts: list[Any], first: float = 0.0) -> Any:
    """Return parts side by side or stacked: of equal size, or with ``first`` percent for the first of two."""
    if len(parts) == 1:
        return parts[0]
    share = first or round(100.0 / len(parts), 3)
    rest = _split(direction, parts[1:])
    return {"direction": direction, "first": parts[0], "second": rest, "splitPercentage": share}


def _airframe() -> dict[str, Any]:
    """Return the settings of the 3-D panel, which follows the vehicle and draws no axes of frames."""
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
        "topics": {topic: {"visible": True} for topic in (SCENE_TOPIC, resolved(MARKERS))},
        "layers": {"grid": grid},
    }
