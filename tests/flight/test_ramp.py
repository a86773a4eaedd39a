"""A ramp of both commands, flown along climbing trims and along static ones."""

import numpy as np
import pytest
from flights import components

from hsv.base.units import FOOT
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.metrics import flight_metrics
from hsv.flight.scenario import load_scenario


def test_a_ramp_that_ends_after_the_flight_is_flown_up_to_the_flights_end():
    whole, short = (load_scenario("case2_baseline", {"fault": [], "duration": f"{t} s"}) for t in (100, 40))
    assert short.command[0].end > short.duration
    states = [fly(assemble_flight(scenario)).history.state for scenario in (whole, short)]
    assert np.array_equal(states[0][: len(states[1])], states[1])


def test_climbing_trims_are_followed_closely_and_static_ones_from_far_behind():
    errors = {}
    for trim in ("climbing", "static"):
        metrics = flight_metrics(fly(components("case2_baseline", **{"reference.trim": trim})).data())
        errors[trim] = [metrics[f"{axis}_error_maximum"] / FOOT for axis in ("altitude", "velocity")]
    assert errors["climbing"][0] < 20.0 < 45.0 < errors["static"][0]
    assert errors["climbing"][1] < 2.0 < 45.0 < errors["static"][1]


def test_the_nominal_system_follows_the_nominal_vehicle():
    """Without fault, coupling and filter the vehicle is the nominal one: the tube has nothing to do."""
    parts = components(
        "case2_baseline",
        **{"vehicle.model": "DM", "notch.enabled": False, "fault.channels": ["none"], "duration": 100.0},
    )
    flight = fly(parts)
    error = flight.history.state - flight.reference - flight.history.deviation
    # What is left is linearisation about trims while x_n is not zero; the climb alone would be 600 ft and 250 ft/s.
    assert np.abs(error[:, 0]).max() < 0.5 and np.abs(error[:, 1]).max() < 0.1


def test_a_step_in_flight_moves_the_nominal_state_and_not_the_vehicle():
    step = {
        "reference.times": [5.0, 5.0],
        "reference.altitudes": [26060.4, 26090.88],
        "reference.velocities": [2407.92, 2407.92],
    }
    flight = fly(components("case2_baseline", duration=6.0, **step))
    planned = flight.reference + flight.history.deviation
    assert np.abs(np.diff(flight.reference[:, 0])).max() == pytest.approx(30.48)
    assert np.abs(np.diff(planned[:, 0])).max() < 0.05
