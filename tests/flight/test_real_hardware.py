"""Flights with actuators, noisy sensors, wind and faults, and an estimator."""

import numpy as np
import pytest
from marking import long
from real_hardware import HARDWARE, RANDOM, SHORT

from hsv.base.errors import ScenarioError
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.model.plant import FlightStatus


def parts(name, **changes):
    return assemble_flight(load_scenario("case1", SHORT | HARDWARE[name] | changes))


@pytest.mark.parametrize("name", [name if "everything" in name or name == "air" else long(name) for name in HARDWARE])
def test_the_seed_decides_all_that_is_random_and_nothing_else(name):
    first = fly(parts(name)).fingerprint
    assert fly(parts(name)).fingerprint == first
    assert (fly(parts(name, seed=8)).fingerprint != first) == (name in RANDOM)


def flown_with(link, **changes):
    return fly(assemble_flight(load_scenario("case1", SHORT | {"link": link} | changes)))


def test_computing_for_whole_periods_is_a_delay_of_the_command_to_the_bit():
    computing, trim = flown_with({"computational_delay": "60 ms"}), parts("air").plant.initial.input
    assert computing.fingerprint == flown_with({"command": {"delay": 3}}).fingerprint
    assert computing.fingerprint == flown_with({"computational_delay": "20 ms", "command": {"delay": 2}}).fingerprint
    history = computing.history
    assert np.array_equal(history.actuator[:3], np.tile(trim, (3, 1)))
    assert np.array_equal(history.actuator[3:], history.command[:-3])


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
        ({"enabled": True}, r"estimator.enabled = true: no noise of altitude, .* or sensors with noise, such as"),
    ],
)
def test_a_malformed_estimator_is_refused(table, message):
    with pytest.raises(ScenarioError, match=message):
        assemble_flight(load_scenario("case1", {"estimator": table}))
