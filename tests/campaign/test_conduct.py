import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from hsv.campaign.conduct import capacity, conduct
from hsv.campaign.fleet import OwnProcess
from hsv.campaign.store import Store, read_campaign
from hsv.campaign.summary import Results
from hsv.errors import CampaignError


class Counting(OwnProcess):
    """Flies here and notes what."""

    def __init__(self):
        self.flown = []

    def fly(self, text, batches):
        for batch, content in super().fly(text, batches):
            self.flown.append(batch)
            yield batch, content


def interrupted_at(flights):
    def progress(done):
        if done >= flights:
            raise KeyboardInterrupt

    return progress


def test_interrupted_twice_and_resumed_gives_the_same_file_and_flies_nothing_twice(planned, results, out):
    campaign, fleet = planned(), Counting()
    for flights in (8, 24):
        with pytest.raises(KeyboardInterrupt):
            conduct(campaign, Store(out, campaign), fleet, progress=interrupted_at(flights))
        assert not out.exists()
    conduct(campaign, Store(out, campaign), fleet)
    assert fleet.flown == list(range(campaign.batches))
    assert out.read_bytes() == results.path.read_bytes()
    assert sorted(path.name for path in out.parent.iterdir()) == [out.name]


DRIVER = """
import sys
from pathlib import Path
from hsv.campaign.campaign import Campaign
from hsv.campaign.conduct import conduct
from hsv.campaign.fleet import OwnProcess
from hsv.campaign.store import Store
campaign = Campaign.from_text(Path(sys.argv[1]).read_text())
print("ready", flush=True)
sys.stdin.readline()
conduct(campaign, Store(Path(sys.argv[2]), campaign), OwnProcess())
"""


def test_a_killed_process_loses_no_finished_batch(planned, tmp_path, out):
    campaign = planned(samples=800)
    (tmp_path / "campaign.json").write_text(campaign.text)
    process = subprocess.Popen(
        [sys.executable, "-c", DRIVER, str(tmp_path / "campaign.json"), str(out)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    process.stdout.readline()
    process.stdin.write("go\n")
    process.stdin.flush()
    store = Store(out, campaign)
    deadline = time.monotonic() + 120.0
    while len(list(store.folder.glob("*.parquet"))) < 3:
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with store.opened() as finished:
        assert finished
    fleet = Counting()
    conduct(campaign, store, fleet)
    assert set(fleet.flown) == set(range(campaign.batches)) - finished
    assert np.array_equal(Results(out).column("flight"), np.arange(800))


def test_a_finished_campaign_is_not_flown_again(planned, results):
    fleet = Counting()
    assert conduct(planned(), Store(results.path, planned()), fleet) == 0
    assert fleet.flown == []


@pytest.mark.parametrize("change", [{"seed": 4}, {"samples": 45}, {"scale": 0.5}, {"commit": "later"}])
def test_another_campaign_does_not_mix_with_one_that_is_there(planned, results, out, change):
    other = planned(**change)
    with pytest.raises(CampaignError, match="holds another campaign"):
        conduct(other, Store(results.path, other), OwnProcess())
    with pytest.raises(KeyboardInterrupt):
        conduct(planned(), Store(out, planned()), OwnProcess(), progress=interrupted_at(8))
    with pytest.raises(CampaignError, match="holds another campaign"):
        conduct(other, Store(out, other), OwnProcess())
    assert conduct(other, Store(out, other), OwnProcess(), restart=True) == other.samples


def test_two_processes_do_not_fly_the_same_campaign(planned, out):
    with (
        Store(out, planned()).opened(),
        pytest.raises(CampaignError, match="in use"),
        Store(out, planned()).opened(),
    ):
        pass


def test_what_is_no_result_of_a_campaign_is_refused(tmp_path):
    (tmp_path / "text.parquet").write_text("nothing")
    for name in ("text.parquet", "missing.parquet"):
        with pytest.raises(CampaignError, match=name):
            read_campaign(tmp_path / name)


def test_capacity_grows_with_flights_and_shrinks_with_cores(planned):
    one, many = capacity(planned(), 1000, 1), capacity(planned(), 1000, 1000)
    assert one.wall_time > 20.0 * many.wall_time > 0.0
    assert one.bytes > 1000 * 8 * 30
