import time

import pytest

from hsv.bench.figure import Figure, interleaved
from hsv.bench.page import cells


def figure(*ours, theirs=(1.0, 1.0, 1.0), **promise):
    return Figure("f", "ours", "theirs", "s", ours, theirs, **promise)


def test_ratios_are_taken_pair_by_pair():
    measured = figure(2.0, 6.0, 4.0, theirs=(1.0, 2.0, 4.0))
    assert measured.ratios.tolist() == [2.0, 3.0, 1.0]
    assert measured.median == 2.0
    assert measured.percentiles == pytest.approx((1.2, 2.8))


@pytest.mark.parametrize(
    ("value", "bound", "verdict"),
    [
        (1.2, "most", "at most 1.3, which is the goal"),
        (1.4, "most", "at most 1.5, as promised; short of the goal, at most 1.3"),
        (1.6, "most", "WORSE than the limit, at most 1.5"),
        (1.6, "least", "at least 1.3, which is the goal"),
        (1.2, "least", "WORSE than the limit, at least 1.5"),
    ],
)
def test_what_is_worse_than_promised_is_said_plainly(value, bound, verdict):
    limit, goal = (1.5, 1.3)
    assert figure(value, theirs=(1.0,), bound=bound, limit=limit, goal=goal).verdict == verdict


def test_a_figure_of_one_side_has_its_unit():
    alone = Figure("f", "ours", "", "s", (2e-6, 4e-6, 3e-6), bound="most", limit=5e-6)
    assert alone.verdict == "at most 5e-06 s, as promised"
    assert cells(alone)[2:6] == ("3 us", "", "", "2.2 to 3.8")


def test_a_lower_limit_is_called_one():
    pace = Figure("f", "ours", "", "x real time", (18.2,), bound="least", limit=8.0)
    assert pace.verdict == "at least 8 x real time, as promised"


def test_nothing_is_promised_without_a_limit():
    rate = figure(0.4, theirs=(1.0,), bound="least")
    assert rate.verdict == ""
    assert rate.is_rate


def test_the_two_sides_are_measured_in_turn():
    order = []
    ours, theirs = interleaved(lambda: order.append("a"), lambda: order.append("b"), 3, time.perf_counter)
    assert "".join(order) == "ab" * 4
    assert len(ours) == len(theirs) == 3
