"""The verdict on a metric."""

import math

import pytest

from hsv.flight.limits import Verdict


@pytest.mark.parametrize(
    ("value", "ended", "words"),
    [
        (-2.0, True, "within"),
        (2.1, True, "over"),
        (math.nan, True, "over"),
        (None, True, "not reached"),
        (0.0, False, "not flown to the end"),
        (None, False, "not flown to the end"),
        (-3.0, False, "over"),
    ],
)
def test_a_limit_is_kept_only_by_a_flight_that_came_to_its_end(value, ended, words):
    verdict = Verdict(2.0, value, ended)
    assert verdict.words == words
    assert verdict.within == (words == "within")
