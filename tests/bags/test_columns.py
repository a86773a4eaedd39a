"""Decoding at once equals decoding one by one, for all our messages."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hsv.bags.columns import Columns, columns_of, read_at_once, read_one_by_one
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter


def columns_at_once(types: Any, name: str, raw: list[bytes]) -> Columns | None:
    read = read_at_once(types, name, raw)
    return read and columns_of(types, name, read)


def assert_same(left: dict[str, np.ndarray], right: dict[str, np.ndarray]) -> None:
    assert list(left) == list(right)
    for path in left:
        assert left[path].dtype == right[path].dtype, path
        assert left[path].shape == right[path].shape, path
        if left[path].dtype == object:
            assert left[path].tolist() == right[path].tolist(), path
        else:
            np.testing.assert_array_equal(left[path], right[path], err_msg=path)


@pytest.mark.parametrize("length", range(6))
def test_at_once_equals_one_by_one(kit: SimpleNamespace, length: int) -> None:
    store, messages = kit.messages.store, kit.messages
    for name in [*kit.types, "rcl_interfaces/msg/Log", "sensor_msgs/msg/JointState", "rosgraph_msgs/msg/Clock"]:
        raw = [messages.serialize(messages.make(name, length)) for _ in range(20)]
        read = read_one_by_one([store.deserialize_cdr(data, name) for data in raw])
        slow = columns_of(store.fielddefs, name, read)
        fast = columns_at_once(store.fielddefs, name, raw)
        if fast is None:
            # Text and messages in sequences are the only ones that are left to the other way.
            assert length and name in ("hsv_msgs/msg/Actuator", "hsv_msgs/msg/Fault", "sensor_msgs/msg/JointState"), (
                name
            )
        else:
            assert_same(fast, slow)


def test_names_shapes_and_values(kit: SimpleNamespace) -> None:
    store, messages = kit.messages.store, kit.messages
    name = "hsv_msgs/msg/TubeStatus"
    vector = store.types["hsv_msgs/msg/InputVector"](fuel_equivalence_ratio=0.25, elevator_deflection=math.nan)
    raw = [
        messages.stamped(name, 3_020_000_000 + k, k, error=np.arange(7.0), u_feedback=vector, inside=True)
        for k in range(3)
    ]
    # The lengths of the other sequences are random: give all rows those of the first.
    first = store.deserialize_cdr(raw[0], name)
    raw = [
        messages.serialize(
            store.types[name](**{**vars(first), "step": k, "header": store.deserialize_cdr(raw[k], name).header})
        )
        for k in range(3)
    ]
    columns = columns_at_once(store.fielddefs, name, raw)
    assert columns["header.stamp"].tolist() == [3_020_000_000, 3_020_000_001, 3_020_000_002]
    assert columns["header.frame_id"].tolist() == [""] * 3
    assert columns["step"].tolist() == [0, 1, 2]
    assert columns["error"].tolist() == [list(range(7))] * 3
    assert columns["u_feedback.fuel_equivalence_ratio"].tolist() == [0.25] * 3
    assert np.isnan(columns["u_feedback.elevator_deflection"]).all()
    assert columns["inside"].all()


def test_lengths_that_differ_at_equal_size_are_noticed(kit: SimpleNamespace) -> None:
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


def test_big_endian_is_left_to_the_other_way(kit: SimpleNamespace) -> None:
    store, messages = kit.messages.store, kit.messages
    name = "hsv_msgs/msg/ControlInput"
    message = messages.make(name, 0)
    swapped = bytes(store.serialize_cdr(message, name, little_endian=False))
    for raw in ([swapped], [messages.serialize(message), swapped]):
        assert columns_at_once(store.fielddefs, name, raw) is None


def test_surplus_that_serialize_message_leaves_is_accepted(kit: SimpleNamespace) -> None:
    """rmw_fastrtps_cpp 8.4 serializes a Float64MultiArray without data into 20 bytes, not 16."""
    store = kit.messages.store
    raw = bytes.fromhex("0001000000000000000000000000000079006700")
    columns = columns_at_once(store.fielddefs, "std_msgs/msg/Float64MultiArray", [raw])
    assert columns["data"].shape == (1, 0)
    assert columns_at_once(store.fielddefs, "std_msgs/msg/Float64MultiArray", [raw + bytes(80)]) is None


@pytest.mark.parametrize("surplus", [b"", bytes.fromhex("ae7f0000006b0cef"), b"\1" * 16])
def test_bag_columns_of_varying_layout_and_of_no_message(kit: SimpleNamespace, tmp_path: Path, surplus: bytes) -> None:
    messages = kit.messages
    fault = messages.fault(0.9)
    topics = [kit.topic("/hsv/actuator", "hsv_msgs/msg/Actuator"), kit.topic("/hsv/none", kit.types[0])]
    writer = BagWriter(tmp_path / "bag", topics)
    for k in range(4):
        data = messages.stamped("hsv_msgs/msg/Actuator", k * 10, k, active=[fault] * (k // 2))
        # serialize_message leaves up to eight bytes for every empty sequence of doubles.
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
