"""Flights with faults, and the severity at which a controller is lost."""

import numpy as np
import pytest

from hsv.flight.metrics import FlightData
from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.faults import TRIED, Moment
from hsv.flight.resilience.flights import ALTITUDE_BAND, ATTITUDE_BAND, Boundary, SubjectRunner, boundary, distances


def as_it_is(severity):
    return severity


@pytest.mark.parametrize("limit", [0.003, 0.31, 0.5, 0.99])
def test_bisection_encloses_a_threshold(limit):
    def survives(severity):
        return severity < limit

    known = {severity: survives(severity) for severity in (0.1, 0.5, 0.9)}
    found = boundary(survives, known, 0.02, as_it_is)
    assert found.survived < limit <= found.lost and found.lost - found.survived <= 0.02 + 1e-9


def test_the_ends_of_a_range_may_be_survived_or_lost():
    assert boundary(lambda severity: True, {0.2: True}, 0.02, as_it_is) == Boundary(1.0, None)
    assert boundary(lambda severity: False, {0.2: False}, 0.02, as_it_is) == Boundary(None, 0.0)


def test_of_severities_that_do_not_rise_the_mildest_loss_counts():
    found = boundary(lambda severity: severity < 0.3, {0.2: True, 0.5: False, 0.8: True}, 0.02, as_it_is)
    assert found.survived < 0.3 <= found.lost


def test_only_severities_that_can_be_flown_are():
    delay, asked = TRIED["elevator_delay"], []

    def survives(severity):
        asked.append(delay.value(severity))
        return delay.value(severity) <= 8

    found = boundary(survives, {0.0: True}, delay.resolution, lambda s: delay.severity(delay.value(s)))
    assert (delay.value(found.survived), delay.value(found.lost)) == (8.0, 9.0)
    assert all(value.is_integer() for value in asked)


def flight(altitude, attitude):
    """A flight of a step a second, at rest but for altitude (m) and pitch angle (rad)."""
    n = len(altitude)
    state, zeros = np.zeros((n, 9)), np.zeros((n, 9))
    state[:, 0], state[:, 3] = altitude, attitude
    two = np.zeros((n, 2))
    return FlightData(np.arange(float(n)), state, zeros, zeros, two, two, np.zeros(n), 2.0)


def test_recovery_is_the_last_exit_from_the_band():
    still, apart = flight(np.zeros(10), np.zeros(10)), np.zeros(10)
    apart[[1, 3, 5]] = 2.0 * ALTITUDE_BAND
    attitude, altitude, recovery = distances(flight(apart, np.zeros(10)), still, 2.0)
    assert (attitude, altitude, recovery) == (0.0, 2.0 * ALTITUDE_BAND, 4.0)
    apart[9] = 2.0 * ALTITUDE_BAND
    assert distances(flight(apart, np.zeros(10)), still, 2.0)[2] is None
    tilted = flight(np.zeros(10), np.full(10, 0.9 * ATTITUDE_BAND))
    assert distances(tilted, still, 2.0) == (pytest.approx(0.9 * ATTITUDE_BAND), 0.0, 0.0)


def test_a_flight_that_ends_early_is_compared_as_far_as_it_goes():
    still = flight(np.zeros(10), np.zeros(10))
    short = flight(np.zeros(6), np.linspace(0.0, 1.0, 6))
    assert distances(short, still, 2.0) == (1.0, 0.0, None)


def test_a_fault_without_effect_leaves_the_flight_where_it_is():
    campaign, fault = plan(("case1",), ("elevator_loss",)), TRIED["elevator_loss"]
    runner = SubjectRunner(campaign.subjects[0], Moment.during)
    flown = runner.outcome("mild", 2, fault, 1.0)
    assert (flown.survived, flown.attitude, flown.altitude, flown.recovery_time) == (True, 0.0, 0.0, 0.0)
    lost = runner.outcome("severe", 0, fault, 0.0)
    assert not lost.survived and 0.0 < lost.time_to_loss < 10.0 and lost.recovery_time is None
