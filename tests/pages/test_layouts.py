"""The layout for viewers names recorded topics only."""

import json
import re

import pytest
from recorded_flight import message_types

from hsv.bags.definitions import fields_of
from hsv.bags.description import TOPICS, resolved
from hsv.pages.airframe.pose import Sample, transforms
from hsv.pages.airframe.scene import SCENE_TOPIC
from hsv.pages.layouts import foxglove_layout

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


def test_curves_are_numbers_of_recorded_messages(types):
    found = list(paths_of_foxglove("Plot"))
    assert len(found) > 30
    for topic, path, title in found:
        assert UNIT.search(title)
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
    assert set(panel["topics"]) == {SCENE_TOPIC}
