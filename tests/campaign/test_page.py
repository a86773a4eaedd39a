"""The page of a campaign."""

import numpy as np

from hsv.campaign.page import BINS, histogram, render


def test_times_of_whole_periods_make_bars_and_no_comb():
    times = 0.02 * np.random.default_rng(1).integers(594, 600, 500)
    bars = histogram(times)
    assert bars["counts"] == [np.count_nonzero(np.isclose(times, 0.02 * k)) for k in range(594, 600)]


def test_bars_hold_all_that_is_finite():
    values = np.r_[np.random.default_rng(1).normal(size=3000), np.nan, np.inf]
    bars = histogram(values)
    assert sum(bars["counts"]) == 3000 and len(bars["counts"]) == BINS == len(bars["edges"]) - 1


def test_what_is_the_same_in_all_flights_is_said_not_drawn(results):
    page = render(results)
    assert "The same in all flights: end time 3&nbsp;s" in page
    assert 'id="histogram-tube_level"' in page and 'id="histogram-end_time"' not in page
