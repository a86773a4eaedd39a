"""Definitions come complete, from the ament index, and say so when they cannot."""

import pytest
from recorded_flight import MESSAGES

from hsv.bags.definitions import SEPARATOR, definition, type_hash
from hsv.base.errors import RecordingError


def test_text_is_root_then_dependencies_once():
    text = definition("hsv_msgs/msg/NominalState")
    root, *others = text.split(f"\n{SEPARATOR}\n")
    assert root == (MESSAGES / "NominalState.msg").read_text()
    assert [other.splitlines()[0] for other in others] == [
        "MSG: std_msgs/Header",
        "MSG: hsv_msgs/LongitudinalState",
        "MSG: hsv_msgs/InputVector",
        "MSG: builtin_interfaces/Time",
    ]
    assert len(SEPARATOR) == 80


def test_hash_is_that_of_the_type(store):
    assert type_hash("hsv_msgs/msg/TubeStatus") == store.hash_rihs01("hsv_msgs/msg/TubeStatus")
    # As published by ROS 2 Jazzy.
    assert type_hash("rosgraph_msgs/msg/Clock") == (
        "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"
    )


@pytest.mark.parametrize("function", [definition, type_hash])
@pytest.mark.parametrize("name", ["hsv_msgs/msg/NoSuch", "nonsense"])
def test_missing_type_is_named(function, name):
    with pytest.raises(RecordingError, match=name) as error:
        function(name)
    assert "\n" not in str(error.value)
