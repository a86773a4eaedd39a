import pytest

from hsv.base.errors import CampaignError, ScenarioError
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import Campaign, plan
from hsv.flight.campaign.sample_runner import SampleRunner
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_names

EVERYTHING = {
    "factors": {
        "fault[0].start": ("1 s", "2.5 s"),
        "fault[0].effectiveness": (0.8, 1.0),
        "initial.altitude": ("26050 m", "26070 m"),
        "initial.velocity": ("2400 m/s", "2415 m/s"),
    }
}


@pytest.mark.parametrize("name", scenario_names()[::6])
def test_every_shipped_scenario_can_be_written(name):
    scenario, campaign = load_scenario(name), plan(name)
    values = scenario.vehicle.perturbation
    written = parse_scenario(campaign.file(0, [values.get(factor.name, 0.0) for factor in campaign.factors]), name)
    assert written.parameters() == {
        **campaign.flown(0, [0.0] * 10).parameters(),
        **scenario.parameters(),
        "seed": 10**7,
    }


@pytest.mark.parametrize("scenario", ["case1_heavy", "case1_uncertain", "case1_hard_sensors"])
def test_a_perturbed_flight_has_the_bits_of_its_scenario(scenario):
    campaign = plan(scenario, samples=2, seed=5)
    assert campaign.perturbed == tuple(factor.name for factor in campaign.factors)
    runner = SampleRunner(campaign)
    for flight, sample in enumerate(campaign.draw(range(2))[0]):
        alone = fly(assemble_flight(campaign.flown(flight, sample)))
        assert runner.fly(flight, sample).fingerprint == alone.fingerprint


def test_a_change_that_no_parameter_admits_is_named():
    runner = SampleRunner(plan("case1", samples=2))
    sample = [-0.95 if factor.name == "mass" else 0.0 for factor in runner.campaign.factors]
    with pytest.raises(ScenarioError, match=r"flight 1: .*mass = '-95 %': expected -90 % to"):
        runner.fly(1, sample)


def test_the_target_stays_where_it_is_when_the_start_moves(planned):
    campaign = planned(samples=50, **EVERYTHING)
    for flight, sample in enumerate(campaign.draw(range(50))[0]):
        flown = campaign.flown(flight, sample)
        assert flown.initial != campaign.scenario.initial
        for column, expected in zip(flown.commands, campaign.scenario.commands, strict=True):
            assert column == pytest.approx(expected, rel=1e-14)


def test_a_campaign_reads_back_as_it_was_written(planned):
    campaign = planned(**EVERYTHING)
    again = Campaign.from_text(campaign.text)
    assert again == campaign
    assert again.digest == campaign.digest
    assert planned(seed=4).difference(planned()) == "seed = 4 there, 3 here"


def test_what_a_scenario_does_not_admit_is_refused_before_anything_flies(planned, short):
    with pytest.raises(ScenarioError, match=r"initial\.altitude"):
        planned(factors={"initial.altitude": ("20000 m", "26000 m")})
    with pytest.raises(ScenarioError, match=r"fault.*effectiveness"):
        planned(factors={"fault[0].effectiveness": (0.5, 1.5)})
    with pytest.raises(ScenarioError, match=r"fault\[0\]\.start = .*: expected"):
        planned(factors={"fault[0].start": ("3 s", "2 s")})
    with pytest.raises(ScenarioError, match=r"fault\[3\]\.start: no such field"):
        planned(factors={"fault[3].start": ("1 s", "2 s")})
    with pytest.raises(CampaignError, match="varies"):
        plan(short, scale=0.0)
