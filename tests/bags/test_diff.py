"""Comparison of bags: equality within a tolerance, and the names of differences."""

import math

import numpy as np
import pytest

from hsv.bags.columns import Track
from hsv.bags.diff import compare

KIND = "hsv_msgs/msg/VehicleForces"


@pytest.fixture
def track(kit):
    def make(values, kind=KIND, **given):
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


def differs(comparison):
    return comparison.first is not None


@pytest.mark.parametrize(
    ("a", "b", "tolerance", "equal"),
    [
        (1e6, 1e6 * (1 + 0.9e-10), 1e-10, True),
        (1e6, 1e6 * (1 + 1.2e-10), 1e-10, False),
        (1e-20, -1e-12, 1e-10, True),
        (1.0, 1.0 + 2.3e-16, 0.0, False),
        (math.inf, math.inf, 0.0, True),
        (math.inf, -math.inf, 1e-10, False),
        (math.nan, math.nan, 0.0, True),
        (math.nan, 1.0, 1e-10, False),
        (0.0, -0.0, 0.0, True),
    ],
)
def test_numbers(track, a, b, tolerance, equal):
    comparison = compare(track([3.0, a]), track([3.0, b]), tolerance=tolerance)
    assert differs(comparison) is not equal
    if not equal:
        assert comparison.first is not None
        assert (comparison.first.step, comparison.first.field, comparison.first.time_ns) == (1, "lift", 20_000_000)
        assert comparison.first.expected is not None and comparison.different_bytes == 1


def test_bytes_that_are_no_difference_in_value_are_told(track):
    other = track([1.0, 2.0])
    padded = Track(other.topic, other.type, other.types, other.times, [data + b"\0" for data in other.data])
    comparison = compare(track([1.0, 2.0]), padded)
    assert not differs(comparison) and comparison.identical
    assert comparison.different_bytes == comparison.different_padding == 2 and comparison.largest == {}
    zeros = compare(track([0.0]), track([-0.0]))
    assert not differs(zeros) and not zeros.identical
    assert (zeros.different_bytes, zeros.different_padding) == (1, 0)


def test_counts_and_order(track):
    shorter = compare(track([1.0, 2.0, 3.0]), track([1.0, 2.0]))
    assert shorter.first is not None and str(shorter.first) == "step 2 /hsv/forces number of messages: 3 became 2"
    late = track([1.0, 2.0])
    late = Track(late.topic, late.type, late.types, [0, 1], late.data)
    assert str(compare(track([1.0, 2.0]), late).first) == "step 1 /hsv/forces message: 'missing' became 'recorded'"
    two = track([1.0, 2.0])
    assert str(compare(two, two.rows([1, 0])).first) == "step 0 /hsv/forces time (ns): 0 became 20000000"
    nothing = compare(track([]), track([]))
    assert nothing.identical


def test_the_largest_difference_of_every_field(track):
    comparison = compare(track([1.0, 2.0, 3.0]), track([1.0, 2.5, 3.25], drag=4.0))
    assert comparison.largest == {"lift": 0.5, "drag": 3.0}
    assert comparison.first is not None and (comparison.first.step, comparison.first.field) == (0, "drag")


def test_arrays_and_lists_of_messages(kit):
    def faults(value, count):
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
