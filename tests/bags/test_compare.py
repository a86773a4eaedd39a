"""What counts as equal, and how a difference is named."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hsv.bags.columns import Track
from hsv.bags.compare import Comparison, compare

KIND = "hsv_msgs/msg/VehicleForces"


@pytest.fixture
def track(kit: SimpleNamespace) -> Any:
    def make(values: list[float], kind: str = KIND, **given: Any) -> Track:
        times = [k * 20_000_000 for k in range(len(values))]
        still = kit.messages.store.types["hsv_msgs/msg/InputVector"](
            fuel_equivalence_ratio=0.3, elevator_deflection=0.2
        )
        air = {"wind_forward": 0.0, "wind_up": 0.0, "density_factor": 1.0}
        fixed = {"pitching_moment": 0.0, "dynamic_pressure": 5.0, "effector": still, **air}
        data = [
            kit.messages.stamped(kind, time, k, **({"lift": values[k], "drag": 1.0, "thrust": 2.0} | fixed | given))
            for k, time in enumerate(times)
        ]
        return Track("/hsv/forces", kind, kit.messages.store, times, data)

    return make


def differs(comparison: Comparison) -> bool:
    return comparison.first is not None


def test_equal_bytes_are_identical(track: Any) -> None:
    comparison = compare(track([1.0, math.nan, math.inf]), track([1.0, math.nan, math.inf]))
    assert comparison.identical and not differs(comparison) and comparison.largest == {}


@pytest.mark.parametrize(
    ("a", "b", "tolerance", "equal"),
    [
        (1.0, 1.0 + 0.9e-10, 1e-10, True),
        (1.0, 1.0 + 1.2e-10, 1e-10, False),
        (1e6, 1e6 * (1 + 0.9e-10), 1e-10, True),
        (1e6, 1e6 * (1 + 1.2e-10), 1e-10, False),
        (1e-20, -1e-12, 1e-10, True),
        (1.0, 1.0 + 2.3e-16, 0.0, False),
        (math.inf, math.inf, 0.0, True),
        (math.inf, -math.inf, 1e-10, False),
        (math.inf, 1e308, 1e-10, False),
        (math.nan, math.nan, 0.0, True),
        (math.nan, 1.0, 1e-10, False),
        (0.0, -0.0, 0.0, True),
    ],
)
def test_numbers(track: Any, a: float, b: float, tolerance: float, equal: bool) -> None:
    comparison = compare(track([3.0, a]), track([3.0, b]), tolerance=tolerance)
    assert differs(comparison) is not equal
    if not equal:
        assert comparison.first is not None
        assert (comparison.first.step, comparison.first.field, comparison.first.time_ns) == (1, "lift", 20_000_000)
        assert comparison.first.expected is not None and comparison.different_bytes == 1


def test_bytes_that_are_no_difference_in_value_are_told(track: Any) -> None:
    other = track([1.0, 2.0])
    padded = Track(other.topic, other.type, other.types, other.times, [data + b"\0" for data in other.data])
    comparison = compare(track([1.0, 2.0]), padded)
    assert not differs(comparison) and comparison.identical
    assert comparison.different_bytes == comparison.different_padding == 2 and comparison.largest == {}
    zeros = compare(track([0.0]), track([-0.0]))
    assert not differs(zeros) and not zeros.identical
    assert (zeros.different_bytes, zeros.different_padding) == (1, 0)


def test_counts_order_and_ignored_fields(track: Any) -> None:
    shorter = compare(track([1.0, 2.0, 3.0]), track([1.0, 2.0]))
    assert shorter.first is not None and str(shorter.first) == "step 2 /hsv/forces number of messages: 3 became 2"
    late = track([1.0, 2.0])
    late = Track(late.topic, late.type, late.types, [0, 1], late.data)
    assert str(compare(track([1.0, 2.0]), late).first) == "step 1 /hsv/forces message: 'missing' became 'recorded'"
    two = track([1.0, 2.0])
    assert str(compare(two, two.rows([1, 0])).first) == "step 0 /hsv/forces time (ns): 0 became 20000000"
    assert not differs(compare(track([1.0]), track([2.0]), ignored=["lift"]))
    nothing = compare(track([]), track([]))
    assert nothing.identical


def test_the_largest_difference_of_every_field(track: Any) -> None:
    comparison = compare(track([1.0, 2.0, 3.0]), track([1.0, 2.5, 3.25], drag=4.0))
    assert comparison.largest == {"lift": 0.5, "drag": 3.0}
    assert comparison.first is not None and (comparison.first.step, comparison.first.field) == (0, "drag")


def test_arrays_and_lists_of_messages(kit: SimpleNamespace) -> None:
    def faults(value: float, count: int) -> Track:
        active = [kit.messages.fault(value)] * count
        still = {"fuel_equivalence_ratio": 0.3, "elevator_deflection": 0.2}
        data = [
            kit.messages.stamped(
                "hsv_msgs/msg/Actuator", 0, 0, active=active, since=np.zeros(count, np.uint64), **still
            )
        ]
        return Track("/hsv/actuator", "hsv_msgs/msg/Actuator", kit.messages.store, [0], data)

    assert compare(faults(0.9, 1), faults(0.9 + 1e-12, 1), tolerance=1e-10).first is None
    for other in (faults(0.8, 1), faults(0.9, 2)):
        first = compare(faults(0.9, 1), other, tolerance=1e-10).first
        assert first is not None and first.field == "active"


def test_different_definitions_where_one_track_is_empty(track: Any, kit: SimpleNamespace) -> None:
    empty = Track("/hsv/forces", "hsv_msgs/msg/VehicleState", kit.messages.store, [], [])
    first = compare(track([1.0]), empty).first
    assert first is not None and (first.step, first.time_ns, first.field) == (0, 0, "lift")
    assert (first.expected, first.actual) == (True, False)


def test_messages_of_one_step_are_compared(track: Any) -> None:
    whole = track([1.0, 2.0, 3.0, 4.0])
    holed = compare(whole, whole.rows([0, 2, 3]))
    assert str(holed.first) == "step 1 /hsv/forces number of messages: 4 became 3"
    assert (holed.common_count, holed.different_bytes, holed.largest) == (3, 0, {}) and not holed.identical
    both = compare(whole.rows([0, 2, 3]), track([1.0, 2.0, 3.5, 4.0]).rows([0, 1, 2]))
    assert str(both.first) == "step 1 /hsv/forces message: 'missing' became 'recorded'"
    assert both.common_count == 2 and both.largest == {"lift": 0.5}
