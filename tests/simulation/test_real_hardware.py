"""Flights with actuators, noisy sensors, wind and faults: the same in every bit however they are flown."""

import numpy as np
import pytest
from flights import step_by_step
from real_hardware import HARDWARE, RANDOM, SHORT

from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario


def parts(name, **changes):
    return assemble_flight(load_scenario("case1", SHORT | HARDWARE[name] | changes))


@pytest.mark.parametrize("name", HARDWARE)
def test_steps_equal_the_compiled_loop_bit_for_bit(name):
    flown = parts(name)
    compiled, stepwise = fly(flown), step_by_step(flown)
    assert stepwise["plant_status"][-1] == compiled.status
    for column, values in compiled.history._asdict().items():
        assert np.array_equal(values, stepwise[column]), column
    assert compiled.fingerprint != fly(assemble_flight(load_scenario("case1", SHORT))).fingerprint


@pytest.mark.parametrize("name", HARDWARE)
def test_the_seed_decides_all_that_is_random_and_nothing_else(name):
    first = fly(parts(name)).fingerprint
    assert fly(parts(name)).fingerprint == first
    assert (fly(parts(name, seed=8)).fingerprint != first) == (name in RANDOM)
