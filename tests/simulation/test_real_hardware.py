"""Flights with actuators, noisy sensors, wind and faults: the same in every bit however they are flown."""

import numpy as np
import pytest
from flights import step_by_step
from real_hardware import HARDWARE, RANDOM, SHORT

from hsv.errors import ScenarioError
from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario
from hsv.vehicle.plant import FlightStatus


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


def test_an_estimator_makes_the_hard_sensors_flyable():
    def elevator_rms(**changes):
        flight = fly(assemble_flight(load_scenario("case1", {"sensors": {"set": "ghv"}, "seed": 1} | changes)))
        assert flight.status is FlightStatus.FINISHED
        before_fault = (flight.time >= 60.0) & (flight.time < 95.0)
        return np.degrees(flight.history.actuator[before_fault, 1].std())

    # Measured: 5.16 deg and 0.32 deg.
    assert elevator_rms() > 4.0
    assert elevator_rms(estimator={"enabled": True}) < 1.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"enabled": 1}, r"estimator.enabled = 1: expected bool"),
        ({"enabled": True}, r"estimator.noise.altitude = 0: expected above 0, its sensor has no noise"),
        ({"noise": {"altitude": "3 s"}}, r"estimator.noise.altitude = '3 s': wrong unit"),
        ({"process": {"thrust": 1.0}}, r"estimator.process.thrust: unknown key"),
    ],
)
def test_a_malformed_estimator_is_refused(table, message):
    with pytest.raises(ScenarioError, match=message):
        assemble_flight(load_scenario("case1", {"estimator": table}))
