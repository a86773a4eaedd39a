"""Case 1 with its commands governed."""

import numpy as np
import pytest
from flights import components

from hsv.control.design import find_design, read_design
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.closed_loop import fly
from hsv.flight.corners import region_parameters
from hsv.flight.governed import governed
from hsv.flight.scenario import load_scenario

FOOT = 0.3048


@pytest.fixture(scope="module")
def flights():
    return {name: fly(components(name, duration=100.0)) for name in ("case1", "case1_governed")}


def test_both_commands_settle_within_30_s(flights):
    flight = flights["case1_governed"]
    for column, change in ((0, 600.0 * FOOT), (1, 250.0 * FOOT)):
        error = np.abs(flight.history.state[:, column] - flight.reference[-1, column])
        assert flight.time[np.flatnonzero(error > 0.02 * change)[-1]] < 30.0


def test_it_stays_near_its_reference_and_moves_nothing_at_once(flights):
    flight = flights["case1_governed"]
    assert np.abs(flight.history.state - flight.reference)[:, 0].max() < 30.0 * FOOT
    assert np.abs(np.diff(flight.history.command[:, 0])).max() < 0.02


def test_the_elastic_rates_are_a_third_of_those_of_the_step(flights):
    step, smooth = (np.abs(f.history.state[:, [6, 8]]).max(axis=0) for f in flights.values())
    assert np.all(smooth < step / 3.0)


def test_the_plan_is_inside_the_tightened_inputs_and_the_governor_takes_it_as_it_is(flights):
    flight, bounds = flights["case1_governed"], read_design(find_design("governed")).plan_bounds
    plan = flight.reference_input + flight.history.nominal_input
    assert np.all((plan > bounds.input_minimum) & (plan < bounds.input_maximum))
    again = governed("case1_governed", load_scenario("case1_governed").settings["reference.blend"]).reference
    times = load_scenario("case1_governed").commands.times
    assert again.corners[-1].time - again.corners[-2].time == pytest.approx(times[-1] - times[-2])


def test_the_design_measures_its_disturbances_along_this_reference():
    declared = region_parameters((inputs := read_inputs(find_inputs("governed"))).model_dump(), inputs.flown_vehicle)
    flown = load_scenario("case1_governed").parameters()
    names = [name for name in declared if name.startswith("reference.")]
    assert "reference.blend" in names
    assert all(declared[name] == pytest.approx(flown[name], rel=1e-12) for name in names)
