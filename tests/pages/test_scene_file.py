"""The copy of a bag for 3-D viewers: the recorded messages, a scene, and the frames in which it moves."""

import numpy as np
import pytest
from bag_readers import by_foxglove
from mcap.reader import make_reader
from recorded_flight import record_flight

from hsv.pages.airframe.geometry import airframe
from hsv.pages.airframe.pose import BODY, LEVEL, Sample, transforms
from hsv.pages.airframe.scene import SCENE_TOPIC, TRANSFORMS_TOPIC, scene
from hsv.pages.airframe.solids import solids
from hsv.pages.scene_file import write_scene

ADDED = {SCENE_TOPIC, TRANSFORMS_TOPIC}


@pytest.fixture(scope="module")
def case1_bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flown", duration=6.0, fault=3.0)


@pytest.fixture(scope="module")
def written(case1_bag, tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "case1.mcap"
    write_scene(case1_bag, path)
    return path


def messages(path, *topics):
    with path.open("rb") as stream:
        return [
            (schema, channel, message) for schema, channel, message in make_reader(stream).iter_messages(topics or None)
        ]


def test_everything_recorded_is_in_it_byte_by_byte(case1_bag, written):
    found = messages(written)
    for topic in case1_bag.topics:
        copied = [(message.log_time, message.data) for _, channel, message in found if channel.topic == topic]
        assert copied == case1_bag.messages(topic)
    times = [message.log_time for *_, message in found]
    assert times == sorted(times)
    with written.open("rb") as stream:
        attached = {each.name: each.data for each in make_reader(stream).iter_attachments()}
    assert attached == case1_bag.attachments


def test_a_rigid_vehicle_is_drawn_as_a_plain_shape(tmp_path):
    flown = record_flight(tmp_path / "flown", "winged_cone", duration=1.0, fault=0.5)
    write_scene(flown, tmp_path / "cone.mcap")
    [(_, _, message)] = messages(tmp_path / "cone.mcap", SCENE_TOPIC)
    plain, parker = scene(0, plain=True), scene(0)
    assert message.data == scene(message.log_time, plain=True).encode()
    assert len(plain.encode()) < 0.2 * len(parker.encode())
    [cone] = solids(plain=True)
    assert np.ptp(cone.triangles[..., 0]) == pytest.approx(airframe().length)


@pytest.mark.viewer
def test_the_readers_of_foxglove_and_lichtblick_decode_it(case1_bag, written):
    by_topic = {}
    for topic, time, message in by_foxglove(written.parent):
        by_topic.setdefault(topic, []).append((time, message))
    assert set(by_topic) == {topic for topic in case1_bag.topics if case1_bag.messages(topic)} | ADDED
    [(_, scene)] = by_topic[SCENE_TOPIC]
    entities = {entity["id"]: entity for entity in scene["entities"]}
    frames = {transform.child for transform in transforms(Sample(*[0.0] * 6))}
    assert {entity["frame_id"] for entity in entities.values()} <= {LEVEL, *frames}
    assert [text["text"] for text in entities["label"]["texts"]] == ["bending x 40"]
    for solid in solids():
        [triangles] = entities[solid.name]["triangles"]
        points = [[point[axis] for axis in "xyz"] for point in triangles["points"]]
        np.testing.assert_array_equal(points, solid.triangles.reshape(-1, 3))
    time, moved = by_topic[TRANSFORMS_TOPIC][-1]
    state = case1_bag.columns("hsv/state")
    row = int(np.flatnonzero(state["header.stamp"] == time)[0])
    [body] = [each for each in moved["transforms"] if each["child_frame_id"] == BODY]
    assert body["timestamp"] == str(time)
    assert -2.0 * np.arcsin(body["rotation"]["y"]) == pytest.approx(state["pitch_angle"][row], rel=1e-12)
