"""The settling times of the comparison page, which steps and ramps have in the same sense."""

import numpy as np
import pytest

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.comparison import settling_times
from hsv.flight.metrics import flight_metrics
from hsv.flight.scenario import load_scenario


def flown(scenario, **changes):
    return fly(assemble({**flight_parameters(load_scenario(scenario)), **changes})).data()


def test_settling_times_of_a_step_are_the_metrics():
    flight = flown("case1")
    metrics = flight_metrics(flight)
    assert settling_times(flight) == pytest.approx(
        [metrics["altitude_settling_time"], metrics["velocity_settling_time"]]
    )


def test_settling_times_of_a_ramp_count_from_its_beginning():
    """As docs/governor.md prints them."""
    assert settling_times(flown("case1_governed")) == pytest.approx([29.0, 28.8], abs=0.05)


def test_a_flight_that_is_too_short_has_not_settled():
    assert np.array_equal(settling_times(flown("case1", duration=50.0)) < np.inf, [True, False])
