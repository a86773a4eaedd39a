"""What is read of flights in pieces, side by side, is what each is alone, in every bit."""

import numpy as np
import pytest
from flights import components

from hsv.core import lanes
from hsv.flight.campaign.sample_runner import PIECE, FlightReader
from hsv.flight.closed_loop import fly
from hsv.flight.metrics import flight_metrics
from hsv.flight.side_by_side import FlightGroup, TubeLevels

WIDTH = lanes()

pytestmark = pytest.mark.skipif(WIDTH == 1, reason="this processor flies one at a time")


def check(reader, flights):
    """Check what ``reader`` tells of these flights; return in which steps they end."""
    assert FlightGroup.takes(flights)
    levels, ends = TubeLevels(flights[0]), []
    for read, own in zip(reader.read(flights), map(fly, flights), strict=True):
        data = own.data()
        assert read.fingerprint == own.fingerprint
        assert read.level == pytest.approx(levels.worst(data), rel=0, abs=0, nan_ok=True)
        assert np.array_equal(read.last, data.state[-1], equal_nan=True)
        assert read.curves.fault_start == own.fault_start
        for name in ("time", "curves", "saturated"):
            assert np.array_equal(getattr(read.curves, name), getattr(data, name), equal_nan=True), name
        assert flight_metrics(read.curves) == own.metrics
        ends.append(len(own.time))
    return ends


def reader_of(parts):
    return FlightReader(parts.plant.steps, TubeLevels(parts))


@pytest.mark.parametrize("rows", [1, PIECE - 1, PIECE, 3 * PIECE + 5])
def test_flights_of_any_length(rows):
    parts = components("case1")
    plant = parts.plant
    plant.steps = rows - 1
    check(reader_of(parts), [parts.perturbed({"mass": 0.01 * i}) for i in range(WIDTH)])


def test_each_that_diverges_ends_on_its_own():
    parts = components("case1", duration=20.0)
    reader = reader_of(parts)
    some = [parts.perturbed({"moment_elevator": -0.85 + 0.01 * i} if i % 3 else {}) for i in range(WIDTH)]
    ends = check(reader, some)
    assert len({end // PIECE for end in ends}) > 1 and max(ends) == 1001
    # What the first flights left behind is not in the next ones.
    assert set(check(reader, [parts.perturbed({"mass": 0.01 * i}) for i in range(3)])) == {1001}
    assert max(check(reader, [parts.perturbed({"moment_elevator": -0.85})] * WIDTH)) < 1001


def test_without_a_set_there_is_no_level():
    parts = components("case1_no_notch", duration=2.0)
    assert all(read.level is None for read in reader_of(parts).read([parts, parts.perturbed({"mass": 0.05})]))
