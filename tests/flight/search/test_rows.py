"""The stored flights of searches: interrupted, in another order or on other workers, they give the same bytes."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from distributed import LocalCluster
from searches import in_memory, required, search

from hsv.base.errors import CampaignError
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import RARE, WORST
from hsv.flight.campaign.executors import Executor, make_executor
from hsv.flight.campaign.summary import Results
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import parse_scenario
from hsv.flight.search import rare, worst
from hsv.flight.search.rows import Rows, check_goal, recorded

METHODS = {WORST: worst.of_campaign, RARE: rare.of_campaign}


class Reversed(Executor):
    """Flies batches in the opposite order, and none after the number ``left``."""

    def __init__(self, left=10**9):
        self.left = left

    def fly(self, job, text, batches, label="batch {}".format):
        for batch in reversed([*batches]):
            if self.left == 0:
                raise KeyboardInterrupt
            self.left -= 1
            yield batch, job(text, batch)


@pytest.fixture(scope="module", params=[WORST, pytest.param(RARE, marks=pytest.mark.long)])
def whole(request, tmp_path_factory):
    """Return a campaign and the results of its search, flown in this process without interruption."""
    folder = tmp_path_factory.mktemp("whole")
    if request.param == WORST:
        campaign = search(WORST, "case1", "tube_level", 64, changes={"duration": "120 s"})
    else:
        campaign = search(RARE, required(folder, "0.49 deg", duration="4 s", fault=[]), "margin_a", rare.LEAST_BUDGET)
    rows = run(campaign, folder / "whole.parquet", Executor())
    results = Results(folder / "whole.parquet")
    assert rows.flown_now == results.campaign.samples
    return campaign, results


def run(campaign, out, executor):
    """Run the search of a campaign, and return its rows."""
    rows = Rows(out, campaign, executor, lambda done: None)
    rows.run(METHODS[campaign.method])
    return rows


def test_an_interrupted_search_resumes_to_the_same_bytes_in_any_order(whole, tmp_path):
    campaign, results = whole
    out = tmp_path / "parts.parquet"
    with pytest.raises(KeyboardInterrupt):
        run(campaign, out, Reversed(5))
    assert 0 < run(campaign, out, Reversed()).flown_now < results.campaign.samples
    assert out.read_bytes() == results.path.read_bytes()
    assert run(campaign, out, Executor()).flown_now == 0
    with pytest.raises(CampaignError, match="holds another campaign"):
        run(replace(campaign, budget=campaign.budget + 1), out, Executor())


@pytest.mark.long
def test_any_number_of_workers_gives_the_same_bytes(whole, tmp_path):
    campaign, results = whole
    with make_executor(2) as two:
        run(campaign, tmp_path / "two.parquet", two)
    logs = logging.CRITICAL
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=logs) as cluster,
        make_executor(0, cluster.scheduler_address) as dask,
    ):
        run(campaign, tmp_path / "dask.parquet", dask)
    for name in ("two", "dask"):
        assert (tmp_path / f"{name}.parquet").read_bytes() == results.path.read_bytes()


def test_a_finished_search_is_repeated_with_its_flights_and_each_flies_alone(whole):
    campaign, results = whole
    of_campaign = METHODS[campaign.method]
    assert of_campaign(results.campaign, recorded(results)) == of_campaign(campaign, in_memory(campaign))
    assert np.array_equal(results.column("flight"), range(results.campaign.samples))
    flight = results.campaign.samples - 1
    alone = fly(assemble_flight(parse_scenario(results.file(flight), "alone")))
    assert alone.fingerprint == results.row(flight)["fingerprint"]


def test_a_goal_is_a_requirement_or_a_metric(tmp_path):
    scenario = search(WORST, "case1", "", 0).scenario
    assert check_goal("tube_level", scenario) == "tube_level"
    with pytest.raises(CampaignError, match="has no requirement"):
        check_goal("", scenario)
    with pytest.raises(CampaignError, match="of = 'attitude': expected"):
        check_goal("attitude", scenario)
    narrow = search(WORST, required(tmp_path, "1 deg"), "", 0).scenario
    assert (check_goal("", narrow), check_goal("a", narrow)) == ("requirements", "margin_a")
