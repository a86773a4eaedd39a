import math
from itertools import accumulate

import numpy as np
import pytest
from flights import components
from pyarrow import parquet

from hsv.base.errors import CampaignError
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.envelope import Envelope, signals, window_starts
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, clopper_pearson, distributions, shares, worst_flights
from hsv.flight.closed_loop import fly
from hsv.pages.campaign import campaign_page, sentence


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
    campaign = plan("case1_derived_no_notch", samples=10)
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
    assert "lost</td>" in campaign_page(lost)


DEEP = """
extends = "case1"
duration = "40 s"
fault = [{channel = "elevator_deflection", type = "loss_of_effectiveness", effectiveness = 0.9, start = "20 s"}]
"""


@pytest.fixture(scope="module")
def partly(tmp_path_factory):
    """Return a campaign in which some flights are lost after the fault."""
    folder = tmp_path_factory.mktemp("partly")
    (folder / "deep.toml").write_text(DEEP)
    factors = {"fault[0].effectiveness": (0.2, 0.9)}
    campaign = plan(str(folder / "deep.toml"), samples=32, factors=factors)
    run_campaign(campaign, ResultStore(folder / "deep.parquet", campaign), Executor())
    return Results(folder / "deep.parquet")


def test_lost_flights_are_counted_apart_and_are_in_no_statistic(partly):
    ended, *limited = shares(partly)
    finished = partly.finished
    assert (ended.within, ended.flights) == (np.count_nonzero(finished), 32) and 0 < ended.within < 32
    assert all(share.flights == ended.within for share in limited)
    decay = next(share for share in limited if share.name == "elastic_decay_time")
    assert decay.within == np.count_nonzero(partly.column("elastic_decay_time")[finished] <= decay.limit) > 0
    found = {d.name: d for d in distributions(partly)}
    assert all(d.flights == ended.within for d in found.values())
    assert found["altitude_end_error"].maximum == np.abs(partly.column("altitude_end_error")[finished]).max()
    assert found["velocity_end_error"].title == "|velocity end error|"
    assert partly.envelope.count.max() == ended.within
    assert f"{32 - ended.within} of 32 flights are lost" in sentence(partly)
    assert f"{decay.within} of {ended.within}" in campaign_page(partly)


def test_a_time_that_was_not_reached_is_null_and_counts_as_longer_than_every_other(partly):
    late = partly.not_reached("velocity_rise_time")
    assert late[partly.finished].all() and np.isnan(partly.column("velocity_rise_time")[late]).all()
    rise = next(d for d in distributions(partly) if d.name == "velocity_rise_time")
    assert (rise.not_reached, rise.minimum) == (np.count_nonzero(partly.finished), math.inf)
    assert worst_flights(partly)[0].limit == "diverged"


@pytest.mark.parametrize("number", [{}, {b"hsv.format": b"3"}])
def test_a_file_of_another_format_is_refused(partly, tmp_path, number):
    table, other = parquet.read_table(partly.path), tmp_path / "other.parquet"
    own = (b"hsv.campaign", b"hsv.envelope", b"hsv.digest")
    kept = {key: parquet.read_metadata(partly.path).metadata[key] for key in own}
    parquet.write_table(table.replace_schema_metadata(kept | number), other)
    with pytest.raises(CampaignError, match=r"format '[13]', expected 2"):
        Results(other)


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
