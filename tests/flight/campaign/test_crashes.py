"""Campaigns of flights that their controller ends: each is recorded as crashed, and the others are flown."""

import numpy as np
import pytest
from c_libraries import build_probe
from pyarrow import parquet

from hsv.base.errors import CampaignError
from hsv.control.library import library_place
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.sample_runner import SampleRunner
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, shares, worst_flights
from hsv.graph.campaign_replay import replay_in_process
from hsv.pages.campaign import write_campaign_page

SCENARIO = """
title = "a library that crashes"
design = ""
controller = "probe.so:probe"
duration = "1 s"
[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"
[probe]
{settings}
"""


@pytest.fixture(scope="module")
def fly(tmp_path_factory):
    """Plan and fly a campaign of a library with settings."""
    folder = tmp_path_factory.mktemp("probe")
    build_probe(folder)

    def fly(name, settings, samples):
        (folder / f"{name}.toml").write_text(SCENARIO.format(settings=settings))
        altitudes = {"initial.altitude": ("25950 m", "26350 m")}
        campaign = plan(str(folder / f"{name}.toml"), samples=samples, scale=0.0, factors=altitudes)
        out = folder / f"{name}.parquet"
        run_campaign(campaign, ResultStore(out, campaign), Executor())
        return Results(out, trust=True)

    return fly


def test_a_flight_that_crashes_is_recorded_and_the_others_are_flown(fly, tmp_path):
    good = fly("good", "", 34)
    altitudes = good.column("sample_initial.altitude")
    *_, second, highest = np.sort(altitudes)
    crashed = fly("crashed", f'crash_above = "{(second + highest) / 2.0} m"', 34)
    [flight] = np.flatnonzero(crashed.crashed)
    assert flight == np.argmax(altitudes)
    assert crashed.row(flight)["crashed"].endswith("probe.so:probe, step 0: crashed (SIGSEGV)")
    assert crashed.row(flight)["end_time"] is None and not crashed.row(flight)["diverged"]
    ours, others = (parquet.read_table(results.path).to_pylist() for results in (crashed, good))
    assert ours[:flight] + ours[flight + 1 :] == others[:flight] + others[flight + 1 :]
    assert shares(crashed)[0].within == 33 and shares(good)[0].within == 34
    first, second, *_ = worst_flights(crashed)
    assert (first.flight, first.limit) == (flight, "crashed") and second.limit != "crashed"
    repeated = replay_in_process(crashed, flight)
    assert not repeated.differing and repeated.repeated["crashed"] == crashed.row(flight)["crashed"]
    write_campaign_page(crashed, tmp_path / "page.html")
    assert "crashed" in (tmp_path / "page.html").read_text()


def test_results_of_two_libraries_are_not_mixed(fly):
    campaign = fly("mixed", "", 2).campaign
    build_probe(library_place(campaign.scenario.controller)[0].parent, "-DSTATE_SIZE=3")
    with pytest.raises(CampaignError, match=r"not the library that the campaign began with, expected the one of SHA-"):
        SampleRunner(campaign)
