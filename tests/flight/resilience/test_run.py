"""Running a campaign to its end, whatever happens in between."""

import os
import signal

import pytest
from node_processes import short_scenario

from hsv.flight.campaign.executors import SerialExecutor, make_executor
from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.faults import SEVERITIES
from hsv.flight.resilience.run import CaseStore, run_resilience

FAULTS = ("elevator_loss", "pitch_rate_drop_out")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return plan((str(short_scenario(tmp_path_factory.mktemp("scenario"), duration=6, fault=2)),), FAULTS)


def kept(store):
    return {path.name: path.read_bytes() for path in store.folder.glob("*.json")}


@pytest.fixture(scope="module")
def whole(campaign, tmp_path_factory):
    """What the campaign brings in this process, undisturbed."""
    store = CaseStore(tmp_path_factory.mktemp("whole"))
    assert run_resilience(campaign, store, SerialExecutor()).cases == len(campaign.cases)
    return kept(store)


def test_interrupted_it_goes_on_where_it_was(campaign, whole, tmp_path):
    store, seen = CaseStore(tmp_path), []

    def interrupt(done):
        seen.append(done)
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_resilience(campaign, store, SerialExecutor(), progress=interrupt)
    [first] = store.folder.glob("*.json")
    written = first.stat().st_mtime_ns
    assert seen == [0, campaign.cases[0].flights]
    assert run_resilience(campaign, store, SerialExecutor()).cases == len(campaign.cases) - 1
    assert first.stat().st_mtime_ns == written and kept(store) == whole


@pytest.mark.long
def test_a_killed_worker_loses_nothing_and_two_bring_what_one_does(campaign, whole, tmp_path):
    store, killed = CaseStore(tmp_path), []
    with make_executor(2) as workers:
        pids = workers.pids()

        def kill(done):
            if done and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        assert run_resilience(campaign, store, workers, progress=kill).cases == len(campaign.cases)
    assert killed and kept(store) == whole


def test_what_is_to_come_is_expected_from_flights_of_every_severity(campaign, tmp_path):
    flown, announced = [], []

    class Watched(SerialExecutor):
        def fly(self, job, text, batches):
            batches = list(batches)
            flown.append((job.__name__, batches))
            return super().fly(job, text, batches)

    run_resilience(campaign, CaseStore(tmp_path), Watched(), expect=announced.append)
    [(timing, timed), (flying, cases)] = flown
    assert (timing, flying) == ("time_flight", "fly_case") and cases == list(range(len(campaign.cases)))
    assert sorted(timed) == list(range(len(SEVERITIES) * len(cases)))  # of so few, each
    assert announced[0].flights == sum(case.flights for case in campaign.cases) and announced[0].wall_time > 0.0


def test_a_damaged_case_is_flown_anew(campaign, whole, tmp_path):
    store = CaseStore(tmp_path)
    store.folder.mkdir()
    for name, content in whole.items():
        store.folder.joinpath(name).write_bytes(content)
    first = min(store.folder.glob("*.json"))
    first.write_text(first.read_text()[:-20])
    assert run_resilience(campaign, store, SerialExecutor()).cases == 1 and kept(store) == whole
