"""Layouts for Foxglove (and Lichtblick) and for PlotJuggler, made from one table of tabs and plots."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from hsv.bags.description import (
    ACTUATOR,
    COMMAND,
    DIAGNOSTICS,
    FORCES,
    MARKERS,
    NOMINAL,
    ROSOUT,
    STATE,
    TUBE_STATUS,
    resolved,
)
from hsv.bags.scene import FAULTS, OVERVIEW_TOPIC
from hsv.model.airframe.pose import LEVEL, Sample, transforms
from hsv.model.airframe.scene import SCENE_TOPIC
from hsv.model.signals import N_RIGID
from hsv.pages.panels import ERRORS, GROUPS, PANELS, Panel, error_panel

NameOf = Callable[[str], str]
"""Returns the name that the topic of a role has in the graph that is shown."""

COLOURS = ("#0072b2", "#d55e00", "#57606a")
TUBE_COLOUR = "#8c959f"


class Line(NamedTuple):
    """A curve: a field of the topic of a role, such as ``reference.altitude``."""

    label: str
    role: str
    field: str


class Chart(NamedTuple):
    """A plot; the title ends with the unit."""

    title: str
    lines: tuple[Line, ...]


def _titled(title: str, unit: str) -> str:
    return f"{title} [{'-' if unit == '1' else unit}]"


def _chart(panel: Panel) -> Chart:
    """Return the curves of a panel that are single fields, because viewers do not add fields."""
    lines = []
    for curve in panel.curves:
        fields = curve.fields if curve.column is None else [f"{field}[{curve.column}]" for field in curve.fields]
        if len(fields) == 1:
            lines.append(Line(curve.label, curve.topic, fields[0]))
    return Chart(_titled(panel.title, panel.unit), tuple(lines))


def _tube_chart(component: int) -> Chart:
    """Return the chart of an error with the centre and the half-width of the tube."""
    title, lines = _chart(error_panel(component))
    tube = {"c": "tube_centre", "z": "tube_half_width"}
    return Chart(title, (*lines, *(Line(label, TUBE_STATUS, f"{field}[{component}]") for label, field in tube.items())))


def _charts(group: str) -> list[Chart]:
    found = []
    for panel in PANELS:
        if panel.group == group:
            found.append(_chart(panel))
            if group == "trajectory":
                title = _titled(f"{panel.title}, deviation of the nominal", panel.unit)
                found.append(Chart(title, (Line("nominal", NOMINAL, f"deviation.{panel.name}"),)))
    return found + ([_tube_chart(component) for component in range(len(ERRORS))] if group == "tube" else [])


def _forces(title: str, *fields: str) -> Chart:
    return Chart(title, tuple(Line(field.replace("_", " "), FORCES, field) for field in fields))


TABS: dict[str, list[Chart]] = {GROUPS[group]: _charts(group) for group in dict.fromkeys(p.group for p in PANELS)} | {
    "Forces": [
        _forces("Lift, drag, thrust [N]", "lift", "drag", "thrust"),
        _forces("Pitching moment [N m]", "pitching_moment"),
        _forces("Dynamic pressure [Pa]", "dynamic_pressure"),
    ],
}
"""Tabs that both viewers have: up to three plots in a column, or more in rows of two."""


def _rows(charts: Sequence[Chart]) -> list[Sequence[Chart]]:
    across = 1 if len(charts) <= 3 else 2
    return [charts[start : start + across] for start in range(0, len(charts), across)]


def foxglove_layout(name_of: NameOf) -> str:
    """Return the layout for Foxglove and Lichtblick as JSON.

    Its first tab shows the vehicle in 3-D and the tube, from topics that a scene adds (:mod:`hsv.bags.scene`).
    """
    panels: dict[str, Any] = {}

    def placed(kind: str, settings: dict[str, Any]) -> str:
        name = f"{kind}!hsv{len(panels):02d}"
        panels[name] = settings
        return name

    def plot(title: str, paths: Sequence[dict[str, Any]]) -> str:
        shown = ("isSynced", "showLegend", "showPlotValuesInLegend", "showXAxisLabels", "showYAxisLabels")
        settings = {"title": title, "paths": paths, "xAxisVal": "timestamp", "legendDisplay": "top"}
        return placed("Plot", settings | dict.fromkeys(shown, True))

    def chart(chart: Chart) -> str:
        lines = zip(chart.lines, COLOURS, strict=False)
        return plot(chart.title, [_path(line.label, name_of(line.role), line.field, colour) for line, colour in lines])

    def rigid(panel: Panel) -> str:
        """Return the plot of a state of the rigid body in its tube."""
        name = panel.name
        paths = [
            _path("vehicle", name_of(STATE), name, COLOURS[0]),
            _path("nominal", OVERVIEW_TOPIC, f"nominal.{name}", COLOURS[1]),
            *(_path("tube", OVERVIEW_TOPIC, f"{edge}.{name}", TUBE_COLOUR, 0.8) for edge in ("lower", "upper")),
        ]
        return plot(_titled(f"{panel.title} and tube", panel.unit), paths)

    faults = _path("active faults", OVERVIEW_TOPIC, FAULTS) | {"timestampMethod": "receiveTime"}
    changing = [
        faults,
        _path("inside the tube", name_of(TUBE_STATUS), "inside"),
        _path("fuel limited", name_of(COMMAND), "saturated[0]"),
        _path("elevator limited", name_of(COMMAND), "saturated[1]"),
    ]
    states = placed("StateTransitions", {"isSynced": True, "showPoints": False, "paths": changing})
    flight = _split(
        "row", [placed("3D", _airframe()), _split("column", list(map(rigid, PANELS[:N_RIGID])))], first=62.0
    )
    log = placed("RosOut", {"topicToRender": ROSOUT, "searchTerms": [], "minLogLevel": 1})
    diagnostics = {"topicToRender": name_of(DIAGNOSTICS), "minLevel": 0, "pinnedIds": [], "hardwareIdFilter": ""}
    below = [
        placed("DiagnosticSummary", diagnostics | {"sortByLevel": True}),
        placed("RawMessages", {"topicPath": name_of(ACTUATOR), "diffEnabled": False}),
    ]
    tabs = {
        "Flight": _split("column", [flight, states], first=80.0),
        **{
            title: _split("column", [_split("row", list(map(chart, row))) for row in _rows(charts)])
            for title, charts in TABS.items()
        },
        "Messages": _split("column", [log, _split("row", below)]),
    }
    tab = placed(
        "Tab", {"activeTabIdx": 0, "tabs": [{"title": title, "layout": layout} for title, layout in tabs.items()]}
    )
    layout = {"configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return json.dumps(layout | {"layout": tab}, indent=1)


def _path(label: str, topic: str, field: str, colour: str = "", size: float = 1.2) -> dict[str, Any]:
    path = {"value": f"{topic}.{field}", "label": label, "enabled": True, "timestampMethod": "headerStamp"}
    return path | ({"color": colour, "showLine": True, "lineSize": size} if colour else {})


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
        "lineWidth": 1,
        "color": "#8c959f66",
        "position": [0, 0, -6],
        "rotation": [0, 0, 0],
    }
    return {
        "cameraState": {
            "perspective": True,
            "distance": 46,
            "phi": 74,
            "thetaOffset": 24,
            "targetOffset": [-1, 0, 0],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.5,
            "far": 5000,
        },
        "followMode": "follow-pose",
        "followTf": LEVEL,
        "scene": {"transforms": {"showLabel": False, "enablePreloading": False}},
        "transforms": {f"frame:{frame}": {"visible": False} for frame in frames},
        "topics": {topic: {"visible": True} for topic in (SCENE_TOPIC, resolved(MARKERS))},
        "layers": {"grid": grid},
    }


def plotjuggler_layout(name_of: NameOf) -> str:
    """Return the layout for PlotJuggler as XML."""
    root = ElementTree.Element("root")
    window = ElementTree.SubElement(root, "tabbed_widget", {"parent": "main_window", "name": "Main Window"})
    for title, charts in TABS.items():
        rows = _rows(charts)
        tab = ElementTree.SubElement(window, "Tab", tab_name=title, containers="1")
        column = _splitter(ElementTree.SubElement(tab, "Container"), "-", len(rows))
        for row in rows:
            place = _splitter(column, "|", len(row))
            for chart in row:
                area = ElementTree.SubElement(place, "DockArea", name=chart.title)
                plot = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines")
                plot.attrib |= {"flip_x": "false", "flip_y": "false"}
                ElementTree.SubElement(plot, "limitY")
                for line, colour in zip(chart.lines, COLOURS, strict=False):
                    name = f"{name_of(line.role)}/{line.field.replace('.', '/')}"
                    ElementTree.SubElement(plot, "curve", name=name, color=colour)
    ElementTree.SubElement(window, "currentTabIndex", index="0")
    ElementTree.SubElement(root, "use_relative_time_offset", enabled="1")
    ElementTree.indent(root, " ")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _splitter(parent: ElementTree.Element, orientation: str, count: int) -> ElementTree.Element:
    if count == 1:
        return parent
    sizes = ";".join([f"{1 / count:f}"] * count)
    return ElementTree.SubElement(parent, "DockSplitter", orientation=orientation, count=str(count), sizes=sizes)


LAYOUTS: dict[str, Callable[[NameOf], str]] = {
    "foxglove.json": foxglove_layout,
    "plotjuggler.xml": plotjuggler_layout,
}
"""Functions that return a layout, by the name of its file."""
