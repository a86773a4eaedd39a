"""Case 1 with nominal gains interpolated between their ellipsoids, beside the switched ones."""

import numpy as np
import pytest
from flights import components

from hsv.flight.closed_loop import fly

RINGING = [6, 8]
"""The two elastic rates in x."""


@pytest.fixture(scope="module")
def flights():
    return {name: fly(components(name, duration=100.0)) for name in ("case1", "case1_smooth")}


def largest_steps(flight):
    """Return the largest changes (2) of the commanded inputs in a period."""
    return np.abs(np.diff(flight.history.command, axis=0)).max(axis=0)


def test_no_input_jumps_where_the_gain_changes(flights):
    switched, smooth = (largest_steps(flight) for flight in flights.values())
    assert switched[0] > 0.09
    assert smooth[0] < 1e-3
    # The jump of the nominal input at the change of a gain is no larger than its own motion in a period elsewhere.
    flown = flights["case1_smooth"].history
    moved = np.abs(np.diff(flown.nominal_input, axis=0))
    changes = np.diff(flown.gain_index) != 0
    assert changes.sum() >= 5
    assert np.all(moved[changes].max(axis=0) <= moved[~changes].max(axis=0))


def test_the_elastic_modes_are_not_rung_by_the_gains(flights):
    # The step of the commands itself rings both; that has died out after 10 s. What is left of the first is its own
    # following of the rigid states.
    switched, smooth = (np.abs(f.history.state[f.time > 10.0][:, RINGING]).max(axis=0) for f in flights.values())
    assert smooth[0] < 0.6 * switched[0] and smooth[1] < 0.1 * switched[1]


def test_both_commands_are_reached_before_the_fault(flights):
    metrics = flights["case1_smooth"].metrics
    assert metrics["altitude_settling_time"] == pytest.approx(59.6, abs=0.1)
    assert metrics["velocity_settling_time"] == pytest.approx(56.5, abs=0.1)
