"""Running a campaign to its end, whatever happens in between."""

import os
import signal

import pytest
from node_processes import short_scenario

from hsv.flight.campaign.executors import Executor, make_executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.store import CaseStore

FAULTS = ("elevator_loss", "pitch_rate_drop_out")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return plan((str(short_scenario(tmp_path_factory.mktemp("scenario"), duration=6, fault=2)),), FAULTS)


def kept(store):
    return {path.name: path.read_bytes() for path in store.folder.glob("*.json")}


@pytest.fixture(scope="module")
def whole(campaign, tmp_path_factory):
    """What the campaign brings in this process, undisturbed."""
    store = CaseStore(tmp_path_factory.mktemp("whole"), campaign)
    assert run_campaign(campaign, store, Executor()).batches == len(campaign.batches)
    return kept(store)


def test_interrupted_it_goes_on_where_it_was(campaign, whole, tmp_path):
    store, seen = CaseStore(tmp_path, campaign), []

    def interrupt(done):
        seen.append(done)
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, store, Executor(), progress=interrupt)
    [first] = store.folder.glob("*.json")
    written = first.stat().st_mtime_ns
    assert seen == [0, campaign.batches[0].flights]
    assert run_campaign(campaign, store, Executor()).batches == len(campaign.batches) - 1
    assert first.stat().st_mtime_ns == written and kept(store) == whole


@pytest.mark.long
def test_a_killed_worker_loses_nothing_and_two_bring_what_one_does(campaign, whole, tmp_path):
    store, killed = CaseStore(tmp_path, campaign), []
    with make_executor(2) as workers:
        pids = workers.pids()

        def kill(done):
            if done and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        assert run_campaign(campaign, store, workers, progress=kill).batches == len(campaign.batches)
    assert killed and kept(store) == whole


def test_the_expected_time_is_that_of_all_flights(campaign, tmp_path):
    announced = []
    run_campaign(campaign, CaseStore(tmp_path, campaign), Executor(), expect=announced.append)
    [needed] = announced
    assert needed.flights == sum(case.flights for case in campaign.batches) and needed.wall_time > 0.0


def test_a_damaged_case_is_flown_anew(campaign, whole, tmp_path):
    store = CaseStore(tmp_path, campaign)
    store.folder.mkdir()
    for name, content in whole.items():
        store.folder.joinpath(name).write_bytes(content)
    first = min(store.folder.glob("*.json"))
    first.write_text(first.read_text()[:-20])
    assert run_campaign(campaign, store, Executor()).batches == 1 and kept(store) == whole
