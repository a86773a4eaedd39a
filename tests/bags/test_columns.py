"""Decoding all messages of a topic at once gives the same columns as decoding them one by one, for all our types."""

import numpy as np
import pytest

from hsv.bags.columns import columns_of, read_at_once, read_one_by_one
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter


def columns_at_once(types, name, raw):
    read = read_at_once(types, name, raw)
    return read and columns_of(types, name, read)


def assert_same(left, right):
    assert list(left) == list(right)
    for path in left:
        np.testing.assert_array_equal(left[path], right[path], err_msg=path, strict=True)


@pytest.mark.parametrize("length", range(6))
def test_at_once_equals_one_by_one(kit, length):
    store, messages = kit.messages.store, kit.messages
    for name in [*kit.types, "rcl_interfaces/msg/Log", "sensor_msgs/msg/JointState", "rosgraph_msgs/msg/Clock"]:
        raw = [messages.serialize(messages.make(name, length)) for _ in range(20)]
        read = read_one_by_one([store.deserialize_cdr(data, name) for data in raw])
        slow = columns_of(store.fielddefs, name, read)
        fast = columns_at_once(store.fielddefs, name, raw)
        if fast is None:
            # Only types with sequences of text or of messages are left to decoding one by one.
            assert length and name.rpartition("/")[2] in ("Actuator", "Fault", "JointState"), name
        else:
            assert_same(fast, slow)


def test_lengths_that_differ_at_equal_size_are_noticed(kit):
    store, messages = kit.messages.store, kit.messages
    name = "hsv_msgs/msg/TubeStatus"
    same = messages.make(name, 0)
    sizes = {"error": (2, 1), "tube_centre": (1, 2), "tube_half_width": (3, 3)}
    raw = [
        messages.serialize(
            store.types[name](**{**vars(same), **{field: np.ones(size[k]) for field, size in sizes.items()}})
        )
        for k in (0, 1)
    ]
    assert len(raw[0]) == len(raw[1])
    assert columns_at_once(store.fielddefs, name, raw) is None


def test_big_endian_is_left_to_the_other_way(kit):
    store, messages = kit.messages.store, kit.messages
    name = "hsv_msgs/msg/ControlInput"
    message = messages.make(name, 0)
    swapped = bytes(store.serialize_cdr(message, name, little_endian=False))
    for raw in ([swapped], [messages.serialize(message), swapped]):
        assert columns_at_once(store.fielddefs, name, raw) is None


@pytest.mark.parametrize("surplus", [b"", bytes.fromhex("ae7f0000006b0cef"), b"\1" * 16])
def test_bag_columns_of_varying_layout_and_of_no_message(kit, tmp_path, surplus):
    messages = kit.messages
    fault = messages.fault(0.9)
    topics = [kit.topic("/hsv/actuator", "hsv_msgs/msg/Actuator"), kit.topic("/hsv/none", kit.types[0])]
    writer = BagWriter(tmp_path / "bag", topics)
    for k in range(4):
        data = messages.stamped("hsv_msgs/msg/Actuator", k * 10, k, active=[fault] * (k // 2))
        # serialize_message leaves up to eight surplus bytes for every empty sequence of doubles.
        writer.write("/hsv/actuator", k * 10, data + surplus * (k // 2))
    writer.close()
    bag = Bag(tmp_path / "bag")
    columns = bag.columns("/hsv/actuator")
    assert columns["header.stamp"].tolist() == [0, 10, 20, 30] and columns["step"].tolist() == [0, 1, 2, 3]
    one = {"channel": "elevator_deflection", "type": "loss_of_effectiveness", "parameter_names": ["effectiveness"]}
    values = [[list(fault.pop("parameter_values")) for fault in faults] for faults in columns["active"]]
    assert columns["active"].tolist() == [[], [], [one], [one]] and values == [[], [], [[0.9]], [[0.9]]]
    empty = bag.columns("/hsv/none")
    assert {len(column) for column in empty.values()} == {0} and "header.stamp" in empty
