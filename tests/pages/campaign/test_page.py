"""The HTML page of a campaign."""

import re
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, Share, limits, shares, within_all
from hsv.pages.campaign import campaign_page, histogram, sentence, share_interval


def test_times_of_whole_periods_make_bars_and_no_comb():
    times = 0.02 * np.random.default_rng(1).integers(594, 600, 500)
    counts, _ = histogram(times)
    assert counts.tolist() == [np.count_nonzero(np.isclose(times, 0.02 * k)) for k in range(594, 600)]


def test_flights_are_counted(results):
    page = campaign_page(results)
    text = re.sub(r"<[^>]+>", " ", re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL))
    for share in shares(results):
        assert f"{share.within} of {share.flights}" in text
    for places in re.findall(r"\d+(\.\d+)? …", text):
        assert not places, "44 flights tell whole percents apart, at most"


def test_it_opens_with_how_many_flights_keep_all_limits(results):
    rows = np.column_stack([np.abs(results.column(name)) <= limit for name, limit in limits(results).items()])
    count = int(np.count_nonzero(rows.all(axis=1)))
    assert within_all(results) == count
    assert rows.shape[1] == 1 and sentence(results).startswith(f"{count} of 44 flights are within the limit. ")
    page = campaign_page(results)
    assert page.index('class="lead') < page.index('class="picture"') < page.index("<table")


def test_a_required_disk_margin_is_judged_once_for_all_flights(results):
    required = Results(results.path)
    text = tomli_w.dumps(results.campaign.table | {"limits": {"disk_margin": 0.7}})
    required.campaign = replace(results.campaign, scenario_text=text)
    assert (
        sentence(required).endswith(" Disk margin at the vertices 0.640 violated (limit 0.7).")
        and results.disk_margin is None
    )
    assert '<p class="lead bad">' in campaign_page(required)


@pytest.mark.parametrize(
    ("flights", "text"), [(64, "94 … 100 %"), (1000, "94.4 … 100.0 %"), (10_000, "94.38 … 100.00 %")]
)
def test_intervals_have_the_digits_that_the_flights_can_tell(flights, text):
    assert share_interval(Share("x", None, flights, flights, (0.94378, 1.0))) == text


def test_a_swept_factor_comes_first(planned, tmp_path):
    campaign = planned(samples=4, factors={"fault[0].effectiveness": [0.9, 0.5]})
    run_campaign(campaign, ResultStore(tmp_path / "swept.parquet", campaign), Executor())
    page = campaign_page(Results(tmp_path / "swept.parquet"))
    assert page.index("<svg") < page.index('class="opening"')
    assert page.index('id="plot-scatter_fault[0].effectiveness"') < page.index('id="plot-scatter_mass"')
    assert len(re.findall(r"<td>0\.[95]</td><td class=\"number\">4 of 4", page)) == 2
