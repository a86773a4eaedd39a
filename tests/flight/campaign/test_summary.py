import math
from itertools import accumulate

import numpy as np
import pytest
from flights import components

from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.envelope import Envelope, signals, window_starts
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, clopper_pearson, distributions, shares, worst_flights
from hsv.flight.closed_loop import fly
from hsv.pages.campaign import campaign_page


def test_clopper_pearson_of_the_textbook():
    # C. J. Clopper, E. S. Pearson, Biometrika 26(4), 1934; 0 of n: 1 - (alpha / 2)^(1 / n).
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 1.0 - 0.025**0.1))
    assert clopper_pearson(10, 10) == pytest.approx((0.025**0.1, 1.0))
    assert clopper_pearson(5, 10) == pytest.approx((0.187086, 0.812914), abs=1e-6)


def test_distributions_and_worst_flights_agree_with_the_columns(results):
    found = {d.name: d for d in distributions(results)}
    assert found["attitude_from_nominal"].maximum == results.column("attitude_from_nominal").max()
    worst = worst_flights(results, 3)
    assert worst[0].ratio == max(results.column("tube_level"))
    assert results.column("tube_level")[worst[0].flight] == worst[0].ratio
    assert worst[0].sample["mass"] == results.row(worst[0].flight)["sample_mass"]


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    """Return a campaign in which flights diverge."""
    campaign = plan("case1_derived_no_notch", samples=10, commit="test")
    out = tmp_path_factory.mktemp("lost") / "lost.parquet"
    run_campaign(campaign, ResultStore(out, campaign), Executor())
    return Results(out)


def test_flights_that_diverge_are_within_no_limit_and_come_first(lost):
    diverged = lost.column("diverged")
    assert diverged.any()
    for share in shares(lost):
        assert share.within <= np.count_nonzero(~diverged)
    worst = worst_flights(lost)
    assert worst[0].limit == "diverged"
    assert lost.column("end_time")[worst[0].flight] == lost.column("end_time").min()
    assert "∞" in campaign_page(lost)


def test_an_envelope_has_the_extremes_and_the_mean_values_of_each_window():
    flown = fly(components("case1", duration=3.0))
    flown.history.state[140:, 6] = np.nan
    envelope = Envelope.empty(50)
    envelope.add(flown, 150)
    envelope.add(flown, 150)
    starts = window_starts(150, 50)
    for window, (start, stop) in enumerate(zip(starts, (*starts[1:], 151), strict=True)):
        for i, curve in enumerate(signals(flown)[:, start:stop].tolist()):
            finite = [value for value in curve if math.isfinite(value)]
            assert envelope.low[window, i] == min(finite, default=math.inf)
            assert envelope.high[window, i] == max(finite, default=-math.inf)
            if stop <= 140:
                mean = list(accumulate(curve))[-1] / (stop - start)
                assert envelope.total[window, i] == pytest.approx(mean + mean, rel=1e-14)
        assert envelope.count[window] == (2.0 if stop <= 140 else 0.0)
