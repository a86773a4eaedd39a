import pytest

from hsv.bags.typestore import message_types
from hsv.base.errors import RecordingError


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
