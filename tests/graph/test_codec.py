"""Messages as bytes: the same as rclpy's, whatever they hold."""

from __future__ import annotations

import random
import string
from typing import Any

import pytest
from rclpy.serialization import deserialize_message, serialize_message

from hsv.bags.description import OTHER_TOPICS, TOPICS
from hsv.base.errors import RunError
from hsv_node.codec import codec
from hsv_node.messages import message_class

TYPES = sorted({*TOPICS.values(), *OTHER_TOPICS.values()})
"""Those of the loop, and others with nested sequences of messages and every kind of number."""

_RANGES = {"boolean": (0, 1), "octet": (0, 255), "uint8": (0, 255)} | {
    f"{sign}int{bits}": (-(2 ** (bits - 1)) * (sign == ""), 2 ** (bits - (sign == "")) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
}


def fill(message: Any, draw: random.Random) -> None:
    """Fill a message of rclpy with numbers, texts and sequences of any length."""
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, value(kind, draw))


def value(kind: str, draw: random.Random) -> Any:
    if kind.startswith("sequence<"):
        return [value(kind[9:-1], draw) for _ in range(draw.randrange(4))]
    if kind.endswith("]"):
        of, _, count = kind[:-1].partition("[")
        return [value(of, draw) for _ in range(int(count))]
    if kind in ("float", "double"):
        return draw.choice([0.0, -0.0, 1.5, -(2.0**-140), float("inf"), draw.getrandbits(20) * 2.0**-30])
    if kind == "string":
        return "".join(draw.choices(string.printable + "äß€", k=draw.randrange(12)))
    if kind in _RANGES:
        number = draw.choice([*_RANGES[kind], draw.randint(*_RANGES[kind])])
        return {"boolean": bool, "octet": lambda n: bytes([n])}.get(kind, int)(number)
    message = message_class("/msg/".join(kind.split("/")))()
    fill(message, draw)
    return message


def packed(kind: str, data: bytes) -> bytes:
    """Return CDR bytes of a message as the codec makes them."""
    return codec(kind).pack(codec(kind).unpack(data)[1:])


def same(plain: Any, typed: Any) -> bool:
    """Compare a message of the codec with one of rclpy."""
    if hasattr(typed, "get_fields_and_field_types"):
        return all(same(getattr(plain, name), getattr(typed, name)) for name in typed.get_fields_and_field_types())
    if isinstance(typed, bytes):
        return plain == typed[0]
    if isinstance(typed, str) or not hasattr(typed, "__len__"):
        return bool(plain == typed)
    return len(plain) == len(typed) and all(map(same, plain, typed))


@pytest.mark.parametrize("kind", TYPES)
def test_rclpy_and_the_codec_read_what_the_other_writes(kind):
    draw, typed_class = random.Random(kind), message_class(kind)
    for _ in range(100):
        typed = typed_class()
        fill(typed, draw)
        data = serialize_message(typed)
        plain = codec(kind).decode(data)
        assert same(plain, typed)
        assert deserialize_message(packed(kind, data), typed_class) == typed
        assert codec(kind).decode(packed(kind, data)) == codec(kind).message(codec(kind).unpack(data)) == plain


def test_equal_messages_are_equal_bytes():
    """The serialization of rmw_fastrtps leaves what was in memory between the fields; the codec leaves zeros."""
    kind = TOPICS["hsv/filtered_state"]
    data = packed(kind, serialize_message(message_class(kind)(filter_state=[1.0], status=3)))
    assert data.count(0) == len(data) - 6


@pytest.mark.parametrize("kind", TYPES)
def test_messages_are_as_long_as_dds_sends_them(kind):
    assert len(packed(kind, serialize_message(message_class(kind)()))) % 4 == 0


@pytest.mark.parametrize("kind", TYPES)
def test_what_is_cut_off_or_of_another_byte_order_is_refused(kind):
    draw, typed = random.Random(kind), message_class(kind)()
    fill(typed, draw)
    whole = packed(kind, serialize_message(typed))
    for length in range(len(whole) - 3):
        with pytest.raises(RunError, match=kind):
            codec(kind).decode(whole[:length])
    with pytest.raises(RunError, match="begins with 0000, expected 0001, little-endian"):
        codec(kind).decode(b"\0\0" + whole[2:])


def test_a_length_beyond_the_message_is_refused_at_once():
    kind = TOPICS["hsv/tube_status"]
    whole = bytearray(packed(kind, serialize_message(message_class(kind)())))
    whole[28:32] = b"\xff\xff\xff\x7f"
    with pytest.raises(RunError, match="length 2147483647 at byte 28"):
        codec(kind).decode(bytes(whole))


@pytest.mark.parametrize("kind", TYPES)
def test_of_whatever_bytes_no_other_error_is_raised_than_that_of_the_codec(kind):
    """What is changed at random is read as some message, the same when it is packed and read again, or refused."""
    draw, read = random.Random(kind), 0
    for _ in range(300):
        typed = message_class(kind)()
        fill(typed, draw)
        data = bytearray(packed(kind, serialize_message(typed)))
        for _ in range(draw.randrange(1, 4)):
            at = draw.randrange(4, len(data))
            # Zeros and small numbers are lengths of something, which most others are not.
            data[at] = draw.choice([0, 1, 2, 4, draw.randrange(256)])
        del data[draw.randrange(len(data) - 4, len(data) + 1) :]
        try:
            plain = codec(kind).decode(bytes(data))
        except RunError as error:
            assert str(error).startswith(kind)
            continue
        read += 1
        values = codec(kind).unpack(bytes(data))
        # By their representations: what is not a number is not equal to itself.
        assert (
            repr(codec(kind).decode(codec(kind).pack(values[1:]))) == repr(codec(kind).message(values)) == repr(plain)
        )
    assert read > 30


def test_an_empty_text_may_lack_the_zero_that_ends_it():
    kind = OTHER_TOPICS["hsv/ready"]
    data = serialize_message(message_class(kind)(run_id="x"))
    without = data[:4] + bytes(4) + data[12:]
    assert codec(kind).decode(without) == codec(kind).decode(data)
    assert codec(kind).pack(codec(kind).unpack(without)[1:]).rstrip(b"\0") == without.rstrip(b"\0")
