import hashlib

import numpy as np
import pytest

from hsv.base.errors import CampaignError, ScenarioError
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import METHODS, Campaign, plan
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
        **campaign.flown(0, [0.0] * len(campaign.factors)).parameters(),
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
    assert again.text == campaign.text
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


def draw(campaign):
    return campaign.draw(range(campaign.samples))


@pytest.mark.parametrize("method", METHODS)
def test_any_flights_can_be_drawn_without_the_others(planned, method):
    campaign = planned(samples=128, method=method)
    samples, seeds = draw(campaign)
    for flights in (range(32), range(32, 64), range(127, 128), range(1)):
        some, their_seeds = campaign.draw(flights)
        assert np.array_equal(some, samples[flights.start : flights.stop])
        assert np.array_equal(their_seeds, seeds[flights.start : flights.stop])


DIGESTS = {
    "uniform": ("07a157195c30bbbc", "83b65801f8d96725"),
    "latin_hypercube": ("984ce635f7c625f2", "750ee73c39f9f5d2"),
    "sobol": ("781056944ef0930f", "750ee73c39f9f5d2"),
    "corners": ("5a92d3fee8f74b06", "2594ed37723f8d48"),
}


@pytest.mark.parametrize("method", METHODS)
def test_samples_stay_what_they_were_in_every_bit(method):
    # Campaigns begun with an earlier version, and replays of their flights, must draw the same samples.
    campaign = plan("case1", method=method, samples=64, seed=7, factors={"fault[0].start": ("90 s", "110 s")})
    drawn = tuple(hashlib.sha256(array.tobytes()).hexdigest()[:16] for array in draw(campaign))
    assert drawn == DIGESTS[method]


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"samples": 0}, "samples"),
        ({"samples": 10**7 + 1}, "samples"),
        ({"samples": 10**6 + 1, "method": "latin_hypercube"}, "samples"),
        ({"samples": 100, "method": "sobol"}, "samples"),
        ({"seed": -1}, "seed"),
        ({"method": "grid"}, "method"),
    ],
)
def test_wrong_settings_are_named(planned, settings, field):
    with pytest.raises(CampaignError, match=rf"^{field} = .*expected"):
        planned(**settings)


@pytest.mark.parametrize("method", METHODS)
def test_a_grid_flies_the_same_vehicles_with_the_same_noise_at_every_point(planned, method):
    one = planned(method=method, samples=4, scale=1.0, factors={})
    swept = planned(
        method=method, samples=4, factors={"fault[0].start": ["1 s", "2 s"], "fault[0].effectiveness": [0.9]}
    )
    assert (swept.samples, swept.vehicles) == (2 * one.samples, one.samples)
    names = [factor.name for factor in swept.factors]
    samples, _ = draw(swept)
    vehicles = samples[:, [not factor.values for factor in swept.factors]]
    np.testing.assert_array_equal(vehicles, np.tile(draw(one)[0], (2, 1)))
    assert samples[:, names.index("fault[0].start")].tolist() == [1.0] * one.samples + [2.0] * one.samples
    assert swept.flight_seed(1) == swept.flight_seed(one.samples + 1) == one.flight_seed(1)
    assert Campaign.from_text(swept.text) == swept
    for flights in (range(3, 6), range(one.samples - 1, one.samples + 1)):
        np.testing.assert_array_equal(swept.draw(flights)[0], samples[flights.start : flights.stop])


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ({"fault[0].start": ["1 s", "1 s"]}, "expected different numbers"),
        ({"fault[0].start": []}, r"expected grid = \[value, value, ...\]"),
        ({"fault[0].start": ["1 s", "200 s"]}, "expected a time before the flight's end"),
    ],
)
def test_a_wrong_grid_is_named(planned, factors, words):
    with pytest.raises(ScenarioError, match=words):
        planned(factors=factors)
