"""Single flights of a campaign, repeated in this process and over DDS."""

import pytest
from ros_domain import own_domain

from hsv.base.errors import CampaignError
from hsv.graph.campaign_replay import replay_in_process, replay_over_dds


@pytest.mark.parametrize("flight", [0, 17, 43])
def test_any_flight_flown_again_alone_is_the_same_in_every_bit(results, flight):
    repeated = replay_in_process(results, flight)
    assert repeated.differing == []
    assert repeated.recorded["end_time"] == 3.0


def test_a_difference_of_one_bit_is_seen(results):
    repeated = replay_in_process(results, 1)
    repeated.repeated["tube_level"] *= 1.0 + 2e-16
    assert repeated.differing == ["tube_level"]


def test_a_flight_that_is_not_there_is_refused(results):
    with pytest.raises(CampaignError, match="flight = 44: expected 0 to 43"):
        replay_in_process(results, 44)


@pytest.mark.long
@pytest.mark.graph
def test_a_flight_over_dds_is_the_same_in_every_bit(results, tmp_path, monkeypatch):
    with own_domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        repeated = replay_over_dds(results, 17, tmp_path / "bag")
    assert repeated.differing == []
    assert repeated.recorded["tube_level"] > 0.0
