"""The layouts for viewers name what is recorded, and nothing else."""

import json
import re
import xml.etree.ElementTree as ElementTree

import pytest
from recorded_flight import message_types

from hsv.bags.description import MARKERS, TOPICS, resolved
from hsv.bags.scene import OVERVIEW_TOPIC
from hsv.bags.typestore import fields_of
from hsv.model.airframe.pose import Sample, transforms
from hsv.model.airframe.scene import SCENE_TOPIC
from hsv.pages.layouts import foxglove_layout, plotjuggler_layout

RECORDED = {resolved(role): kind for role, kind in TOPICS.items()} | {
    "/rosout": "rcl_interfaces/msg/Log",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
UNIT = re.compile(r"\[(-|s|m|m/s|rad|rad/s|kg\^0\.5 m|kg\^0\.5 m/s|N|N m|Pa)\]$")


@pytest.fixture(scope="module")
def types():
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


def test_the_vehicle_is_drawn_in_the_frames_and_on_the_topics_that_there_are():
    [panel] = panels_of_foxglove("3D")
    frames = {end for transform in transforms(Sample(*[0.0] * 6)) for end in (transform.parent, transform.child)}
    assert {name.removeprefix("frame:") for name in panel["transforms"]} == frames
    assert panel["followTf"] in frames and panel["followMode"] in ("follow-pose", "follow-position", "follow-none")
    assert all(layer["frameId"] in frames for layer in panel["layers"].values())
    assert set(panel["topics"]) == {SCENE_TOPIC, resolved(MARKERS)}


def test_both_layouts_show_the_same_in_plots_that_name_the_unit():
    curves = sorted(curves_of_foxglove())
    assert curves == sorted(curves_of_plotjuggler())
    assert all(UNIT.search(title) for *_, title in curves)
