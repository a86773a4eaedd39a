"""Running a campaign to its end, whatever happens in between."""

import pytest
from node_processes import short_scenario

from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.store import CaseStore
from hsv.flight.sources import drop_older

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


def test_a_damaged_case_is_flown_anew(campaign, whole, tmp_path):
    store = CaseStore(tmp_path, campaign)
    store.folder.mkdir()
    for name, content in whole.items():
        store.folder.joinpath(name).write_bytes(content)
    first = min(store.folder.glob("*.json"))
    first.write_text(first.read_text()[:-20])
    assert run_campaign(campaign, store, Executor()).batches == 1 and kept(store) == whole


def test_only_the_newest_cases_of_a_campaign_are_kept(tmp_path):
    new, old = "0123456789ab", "ba9876543210"
    for name in (f"case1_{new}", f"case1_{old}", f"case1_no_notch_{old}"):
        (tmp_path / name).mkdir()
    drop_older(tmp_path / f"case1_{new}")
    assert {path.name for path in tmp_path.iterdir()} == {f"case1_{new}", f"case1_no_notch_{old}"}
