"""The layouts for viewers name what is recorded, and nothing else."""

import json
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from recorded_flight import message_types
from rosbags.typesys.store import Typestore

from hsv.bags.description import MARKERS, TOPICS, resolved
from hsv.bags.scene import OVERVIEW_SCHEMA, OVERVIEW_TOPIC, PARTS, STATES, overview_message
from hsv.bags.typestore import fields_of
from hsv.model.airframe.pose import Sample, transforms
from hsv.model.airframe.scene import SCENE_TOPIC
from hsv.pages.layouts import foxglove_layout, plotjuggler_layout

RECORDED = {resolved(role): kind for role, kind in TOPICS.items()} | {
    "/rosout": "rcl_interfaces/msg/Log",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
PATH = re.compile(r"(/[A-Za-z_]\w*)+(\.[A-Za-z_]\w*(\[\d+\])?)+")
"""Message paths of Foxglove without quotes, filters and slices."""
PANELS = {"3D", "Plot", "StateTransitions", "Tab", "RosOut", "DiagnosticSummary", "RawMessages"}
"""Types of panels in Foxglove and in Lichtblick."""
PLOTJUGGLER_TYPE = re.compile(r"[a-zA-Z]\w*(/[a-zA-Z]\w*)?(\[\d*\])?")
"""Types that PlotJuggler's parser reads: it takes a bounded sequence for one number, and what follows for garbage."""
UNIT = re.compile(r"\[(-|s|m|m/s|rad|rad/s|kg\^0\.5 m|kg\^0\.5 m/s|N|N m|Pa)\]$")


@pytest.fixture(scope="module")
def types() -> Typestore:
    return message_types()


def foxglove():
    return json.loads(foxglove_layout(resolved))


def panels_of_foxglove(kind):
    return [panel for name, panel in foxglove()["configById"].items() if name.startswith(f"{kind}!")]


def paths_of_foxglove(kind):
    for panel in panels_of_foxglove(kind):
        for path in panel["paths"]:
            topic, _, field = path["value"].partition(".")
            yield topic, field.split("."), panel.get("title")


def curves_of_foxglove():
    """Yield the curves of plots that draw recorded topics alone: the others need what a scene adds."""
    beside = {title for topic, _, title in paths_of_foxglove("Plot") if topic == OVERVIEW_TOPIC}
    return (curve for curve in paths_of_foxglove("Plot") if curve[2] not in beside)


def curves_of_plotjuggler():
    root = ElementTree.fromstring(plotjuggler_layout(resolved))
    for area in root.iter("DockArea"):
        for curve in area.iter("curve"):
            name = curve.attrib["name"]
            topic = next(topic for topic in sorted(RECORDED, key=len, reverse=True) if name.startswith(f"{topic}/"))
            yield topic, name.removeprefix(f"{topic}/").split("/"), area.attrib["name"]


def test_curves_are_numbers_of_recorded_messages(types):
    found = list(curves_of_foxglove())
    assert len(found) > 30
    for topic, path, _ in found:
        kind = RECORDED[topic]
        for depth, part in enumerate(path):
            name, _, index = part.partition("[")
            field = next((field for field in fields_of(types.fielddefs, kind) if field.name == name), None)
            assert field is not None, f"{topic}: {kind} has no field {name}"
            assert bool(index) == (field.count != "one"), f"{topic}.{'.'.join(path)}"
            if index and field.count == "array":
                assert int(index.rstrip("]")) < field.length
            assert bool(field.format) == (depth == len(path) - 1), f"{topic}.{'.'.join(path)}"
            kind = field.type


@pytest.mark.parametrize("topic", RECORDED)
def test_plotjuggler_can_read_every_recorded_definition(types, topic):
    definition, _ = types.generate_msgdef(RECORDED[topic], ros_version=2)
    fields = [line for line in definition.splitlines() if line and not line.startswith(("=", "MSG:"))]
    assert fields
    for field in fields:
        assert PLOTJUGGLER_TYPE.fullmatch(field.split()[0]), field


def test_names_of_plotjuggler_are_those_that_its_parser_makes(types):
    def series(kind, prefix):
        for field in fields_of(types.fielddefs, kind):
            lengths = {"one": None, "array": field.length}.get(field.count, 13)
            for path in [f"{prefix}/{field.name}{'' if lengths is None else f'[{i}]'}" for i in range(lengths or 1)]:
                yield from series(field.type, path) if field.is_message else [path]

    made = {name for topic, kind in TOPICS.items() for name in series(kind, resolved(topic))}
    root = ElementTree.fromstring(plotjuggler_layout(resolved))
    assert {curve.attrib["name"] for curve in root.iter("curve")} <= made


def test_what_a_scene_adds_is_drawn_and_has_the_fields_that_are(types):
    drawn = [curve for curve in paths_of_foxglove("Plot") if curve not in list(curves_of_foxglove())]
    assert {topic for topic, *_ in drawn} == {"/hsv/state", OVERVIEW_TOPIC}
    message = json.loads(overview_message(np.arange(5.0), [0.0] * 5, [1.0] * 5, []))
    for topic, path, title in drawn:
        assert UNIT.search(title), title
        if topic == OVERVIEW_TOPIC:
            part, field = path
            assert isinstance(message[part][field], float)
            assert OVERVIEW_SCHEMA["properties"][part]["properties"][field] == {"type": "number"}
        else:
            assert path[0] in {field.name for field in fields_of(types.fielddefs, RECORDED[topic])}
    assert {tuple(path) for topic, path, _ in drawn if topic == OVERVIEW_TOPIC} == {
        (part, field) for part in PARTS for field in STATES
    }


def test_states_that_change_are_texts_and_booleans_of_messages(types):
    for topic, path, _ in paths_of_foxglove("StateTransitions"):
        if topic == OVERVIEW_TOPIC:
            assert OVERVIEW_SCHEMA["properties"][path[0]] == {"type": "string"}
        else:
            name, _, index = path[0].partition("[")
            [field] = [field for field in fields_of(types.fielddefs, RECORDED[topic]) if field.name == name]
            assert field.format == "?" and bool(index) == (field.count != "one")


def test_the_vehicle_is_drawn_in_the_frames_and_on_the_topics_that_there_are():
    [panel] = panels_of_foxglove("3D")
    frames = {end for transform in transforms(Sample(*[0.0] * 6)) for end in (transform.parent, transform.child)}
    assert {name.removeprefix("frame:") for name in panel["transforms"]} == frames
    assert panel["followTf"] in frames and panel["followMode"] in ("follow-pose", "follow-position", "follow-none")
    assert all(layer["frameId"] in frames for layer in panel["layers"].values())
    assert set(panel["topics"]) == {SCENE_TOPIC, resolved(MARKERS)}


def test_paths_and_panels_of_foxglove_are_in_its_grammar():
    for name, panel in foxglove()["configById"].items():
        assert name.partition("!")[0] in PANELS
        for path in panel.get("paths", ()):
            assert PATH.fullmatch(path["value"]), path["value"]


def test_both_layouts_show_the_same_in_plots_that_name_the_unit():
    curves = sorted(curves_of_foxglove())
    assert curves == sorted(curves_of_plotjuggler())
    assert all(UNIT.search(title) for *_, title in curves)


def test_every_panel_of_foxglove_is_placed_once():
    layout = foxglove()
    placed = []

    def walk(node):
        if isinstance(node, str):
            placed.append(node)
            for tab in layout["configById"][node].get("tabs", ()):
                walk(tab["layout"])
        else:
            assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100
            walk(node["first"])
            walk(node["second"])

    walk(layout["layout"])
    assert sorted(placed) == sorted(layout["configById"])


def test_topics_of_other_panels_are_recorded():
    for panel in foxglove()["configById"].values():
        topic = panel.get("topicToRender") or panel.get("topicPath")
        assert topic is None or topic in RECORDED


def test_sizes_of_plotjuggler_fit_their_splitters():
    root = ElementTree.fromstring(plotjuggler_layout(resolved))
    for splitter in root.iter("DockSplitter"):
        sizes = [float(size) for size in splitter.attrib["sizes"].split(";")]
        assert len(sizes) == len(splitter) == int(splitter.attrib["count"])
        assert sum(sizes) == pytest.approx(1.0, abs=1e-4)
