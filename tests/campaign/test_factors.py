import numpy as np
import pytest

from hsv.campaign.campaign import Campaign, plan
from hsv.campaign.sampling import Sampler
from hsv.errors import CampaignError, ScenarioError
from hsv.simulation.scenario import load_scenario, parse_scenario, scenario_names

EVERYTHING = {
    "fault_start": (1.0, 2.5),
    "fault_value": (0.8, 1.0),
    "initial_altitude": (26050.0, 26070.0),
    "initial_velocity": (2400.0, 2415.0),
}


def test_a_written_scenario_reads_as_the_flight_that_was_flown_in_every_bit(planned):
    campaign = planned(samples=50, **EVERYTHING)
    for sample in Sampler(campaign).draw(range(50))[0]:
        flown = campaign.flown(sample)
        assert parse_scenario(campaign.file(sample), flown.name) == flown


@pytest.mark.parametrize("name", scenario_names())
def test_every_shipped_scenario_can_be_written(name):
    scenario, campaign = load_scenario(name), plan(name)
    values = scenario.vehicle.perturbation
    written = parse_scenario(campaign.file([values.get(factor.name, 0.0) for factor in campaign.factors]), name)
    assert written.parameters() == {**campaign.flown([0.0] * 10).parameters(), **scenario.parameters()}


def test_the_target_stays_where_it_is_when_the_start_moves(planned):
    campaign = planned(samples=50, **EVERYTHING)
    for sample in Sampler(campaign).draw(range(50))[0]:
        flown = campaign.flown(sample)
        assert flown.initial != campaign.scenario.initial
        for column, expected in zip(flown.commands, campaign.scenario.commands, strict=True):
            assert column == pytest.approx(expected, rel=1e-14)


def test_a_campaign_reads_back_as_it_was_written(planned):
    campaign = planned(**EVERYTHING)
    again = Campaign.from_text(campaign.text)
    assert again == campaign
    assert again.digest == campaign.digest
    assert planned(seed=4).difference(planned()) == "seed = 4 there, 3 here"


def test_batches_cover_all_flights_once(planned):
    for samples in (1, 8, 9, 44, 10_000):
        campaign = planned(samples=samples)
        flights = [flight for batch in range(campaign.batches) for flight in campaign.flights(batch)]
        assert np.array_equal(flights, np.arange(samples))


def test_what_a_scenario_does_not_admit_is_refused_before_anything_flies(planned, short):
    with pytest.raises(ScenarioError, match=r"initial\.altitude"):
        planned(initial_altitude=(20000.0, 26000.0))
    with pytest.raises(ScenarioError, match=r"fault\[0\]\.value"):
        planned(fault_value=(0.5, 1.5))
    with pytest.raises(CampaignError, match="increases"):
        planned(fault_start=(3.0, 2.0))
    with pytest.raises(CampaignError, match="varies"):
        plan(short, scale=0.0)
