"""Complete message definitions come from the ament index; a missing one is named."""

import pytest
from recorded_flight import MESSAGES

from hsv.bags.definitions import SEPARATOR, definition, message_types, type_hash
from hsv.base.errors import RecordingError


def test_text_is_root_then_dependencies_once():
    text = definition("hsv_msgs/msg/NominalState")
    root, *others = text.split(f"\n{SEPARATOR}\n")
    assert root == (MESSAGES / "NominalState.msg").read_text()
    expected = ["std_msgs/Header", "hsv_msgs/LongitudinalState", "hsv_msgs/InputVector", "builtin_interfaces/Time"]
    assert [other.splitlines()[0] for other in others] == [f"MSG: {name}" for name in expected]
    assert len(SEPARATOR) == 80


def test_hash_is_that_of_the_type(store):
    assert type_hash("hsv_msgs/msg/TubeStatus") == store.hash_rihs01("hsv_msgs/msg/TubeStatus")
    published = "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"  # by ROS 2 Jazzy
    assert type_hash("rosgraph_msgs/msg/Clock") == published


@pytest.mark.parametrize("function", [definition, type_hash])
@pytest.mark.parametrize("name", ["hsv_msgs/msg/NoSuch", "nonsense"])
def test_missing_type_is_named(function, name):
    with pytest.raises(RecordingError, match=name) as error:
        function(name)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("float64 2x", "definition of a/msg/B: Could not parse"),
        ("uint8 X = [1]\nfloat64 y", "definition of a/msg/B: cannot be used (AssertionError)"),
        ("float64 X = 1e999\nfloat64 y", "definition of a/msg/B: cannot be used (NameError)"),
        ("c/D d", "definition of a/msg/B: unknown type c/msg/D"),
        ("B b", "definition of a/msg/B: a/msg/B holds itself"),
    ],
)
def test_a_definition_that_cannot_be_used_is_named(text, why):
    with pytest.raises(RecordingError) as caught:
        message_types([("a/msg/B", text)], "bag")
    assert str(caught.value).startswith(f"bag: {why}")
    assert "\n" not in str(caught.value)
    assert "a/msg/B" not in message_types([], "bag", [("a/msg/B", text)]).fielddefs
