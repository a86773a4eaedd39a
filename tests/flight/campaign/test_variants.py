"""Components of a flight that share what its change leaves as it was are those that its scenario describes."""

from dataclasses import fields

import numpy as np
import pytest

from hsv.base.errors import ScenarioError
from hsv.core import Data
from hsv.flight.assembly import assemble, scenario_parameters
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.sample_runner import SampleRunner


def same(a, b):
    if isinstance(a, Data):
        a, b = (tuple(getattr(each, field.name) for field in fields(each)) for each in (a, b))
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return np.array_equal(a, b)


@pytest.mark.parametrize("scenario", ["case1", "case1_uncertain", "case1_hard_sensors"])
def test_a_perturbed_flight_has_the_components_of_its_scenario(scenario):
    campaign = plan(scenario, samples=8, seed=5)
    assert campaign.perturbed == tuple(factor.name for factor in campaign.factors)
    runner = SampleRunner(campaign)
    for flight, sample in enumerate(runner.campaign.draw(range(8))[0]):
        found = runner._components(flight, sample)
        expected = assemble({**campaign.design, **scenario_parameters(campaign.flown(flight, sample))})
        assert same(found.plant.data, expected.plant.data)
        assert same(found.plant.initial.state, expected.plant.initial.state)
        assert found.plant.steps == expected.plant.steps
        assert found.fault_injector.seed == expected.fault_injector.seed
        assert found.fault_injector.scheduled == expected.fault_injector.scheduled
        assert same(found.nominal_trajectory.reference.data, expected.nominal_trajectory.reference.data)


def test_parameters_that_do_not_vary_stay_perturbed_as_in_the_scenario():
    campaign = plan("case1_heavy", samples=2, scale=0.0, factors={"mass": ("-5 %", "5 %")})
    assert campaign.perturbed == ("mass",)
    expected = campaign.scenario.vehicle.perturbation
    vehicle = SampleRunner(campaign)._components(0, [0.01]).plant.vehicle
    nominal = SampleRunner(campaign)._variants._vehicle
    for name, change in expected.items():
        change = 0.01 if name == "mass" else change
        assert getattr(vehicle, name) == getattr(nominal, name) * (1.0 + change)


def test_a_change_that_no_parameter_admits_is_named():
    runner = SampleRunner(plan("case1", samples=2))
    names = [factor.name for factor in runner.campaign.factors]
    sample = [-0.95 if name == "mass" else 0.0 for name in names]
    with pytest.raises(ScenarioError, match=r"flight 1: .*mass = '-95 %': expected -90 % to"):
        runner.fly(1, sample)


def test_where_more_varies_nothing_is_left_out():
    assert plan("case1", samples=2, factors={"fault[0].start": ("90 s", "110 s")}).perturbed == ()
