"""Topics of a bag are identified by their role under any namespace and remapping."""

from dataclasses import replace

import pytest
from changed_bags import changed_bag
from recorded_flight import record_flight

from hsv.bags.description import ACTUATOR, COMMAND, STATE, TOPICS, checked_namespace, resolved
from hsv.bags.diff import compare
from hsv.bags.flight import flight_fingerprint
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import controller_of, flown_parameters
from hsv.bags.replay.engine import rerun
from hsv.bags.roles import naming, roles
from hsv.bags.steps import bag_warnings
from hsv.base.errors import ParameterError, RecordingError


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flown", duration=11.0, fault=1.0).folder


def moved(source, target, names):
    """Return a copy of a bag with renamed topics and without a record of the renaming, as from ros2 bag record."""
    return changed_bag(source, target, lambda topic: replace(topic, name=names(topic.name)))


def test_a_bag_in_a_namespace_is_like_any_other(flown, tmp_path):
    original, bag = Bag(flown), Bag(moved(flown, tmp_path / "moved", lambda name: f"/lab/veh1{name}"))
    assert bag.namespace == "/lab/veh1" and bag.name_of(STATE) == "/lab/veh1/hsv/state"
    assert flight_fingerprint(bag) == flight_fingerprint(original) is not None
    assert bag_warnings(bag) == bag_warnings(original)
    for role in TOPICS:
        assert bag.messages(role) == bag.messages(bag.name_of(role)) == original.messages(role)
        assert compare(original.track(role), bag.track(role)).identical
    values = flown_parameters(bag)
    assert all(result.identical for result in rerun(bag, controller_of(values), values, lambda *_: None))


def test_what_a_bag_says_of_its_remappings_is_taken(flown, tmp_path):
    others = {STATE: "/truth", COMMAND: "/veh1/wish"}
    names = {resolved(role): others.get(role, resolved(role, "/veh1")) for role in TOPICS}
    said = naming({role: names[resolved(role)] for role in TOPICS}, "/veh1")
    made = changed_bag(
        flown, tmp_path / "said", lambda topic: replace(topic, name=names.get(topic.name, topic.name)), custom_data=said
    )
    bag = Bag(made)
    assert bag.namespace == "/veh1"
    assert {role: bag.name_of(role) for role in TOPICS} == {role: names[resolved(role)] for role in TOPICS}
    assert flight_fingerprint(bag) == flight_fingerprint(Bag(flown))


def test_a_remapped_topic_is_told_by_its_type_where_no_other_has_it(flown, tmp_path):
    bag = Bag(moved(flown, tmp_path / "truth", lambda name: "/truth" if name == resolved(STATE) else name))
    assert bag.name_of(STATE) == "/truth" and flight_fingerprint(bag) == flight_fingerprint(Bag(flown))
    renamed = {resolved(COMMAND): "/a", resolved(ACTUATOR): "/b"}
    bag = Bag(moved(flown, tmp_path / "renamed", lambda name: renamed.get(name, name)))
    assert (bag.name_of(COMMAND), bag.name_of(ACTUATOR)) == ("/a", "/b")
    # If two topics have its type, neither is identified.
    kinds = {name: topic.type for name, topic in bag.topics.items()}
    assert COMMAND not in roles(kinds | {"/c": TOPICS[COMMAND]}, {}, "two.mcap")


def test_topics_of_two_graphs_are_refused(flown, tmp_path):
    kinds = {resolved(role, space): kind for space in ("/veh1", "/veh2") for role, kind in TOPICS.items()}
    with pytest.raises(RecordingError, match=r"two\.mcap: holds the topics of 2 graphs, in /veh1, /veh2"):
        roles(kinds, {}, "two.mcap")
    # A shadow controller, which only publishes a command, does not make a second graph.
    shadow = {resolved(role): kind for role, kind in TOPICS.items()} | {"/shadow/hsv/command": TOPICS[COMMAND]}
    assert roles(shadow, {}, "one.mcap") == {role: resolved(role) for role in TOPICS}


@pytest.mark.parametrize("text", ["//veh", "/veh/", "9x", "/a/9x", "a b", "/é", "/a" * 101])
def test_what_is_no_namespace(text):
    with pytest.raises(ParameterError, match="namespace"):
        checked_namespace(text)
