import os
import signal

import pytest

from hsv.campaign.conduct import conduct
from hsv.campaign.fleet import fleet
from hsv.campaign.store import Store
from hsv.errors import CampaignError


def test_a_worker_killed_in_mid_campaign_loses_and_doubles_nothing(planned, results, out):
    campaign, killed = planned(), []

    with fleet(2) as workers:
        pids = workers._client.run(os.getpid)
        assert len(pids) == 2

        def progress(done):
            if done and not killed:
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)

        assert conduct(campaign, Store(out, campaign), workers, progress=progress) == campaign.samples
    assert killed
    assert out.read_bytes() == results.path.read_bytes()


def test_a_scheduler_that_does_not_answer_is_named():
    with pytest.raises(CampaignError, match="nowhere"), fleet(1, "nowhere://"):
        pass


@pytest.mark.parametrize("workers", [0, -1, 100_000])
def test_an_impossible_number_of_workers_is_refused(workers):
    with pytest.raises(CampaignError, match=f"workers = {workers}"), fleet(workers):
        pass
