"""Differences between runs, especially between runs that nearly agree."""

import pytest
from recorded_flight import record_flight

from hsv.pages.flights import reported_runs
from hsv.pages.report import flight_differences, happened


@pytest.fixture(scope="module")
def nearly(bags):
    """Return the quiet flight with a slightly different notch filter."""
    return record_flight(bags / "nearly", notch__zero_frequency=[15.0001])


def by_panel(runs):
    return {found[0].panel.name: found for found in flight_differences(runs)}


def test_a_flight_does_not_differ_from_itself(quiet):
    runs = reported_runs([quiet, quiet])
    found = flight_differences(runs)
    assert found and not any(difference.largest for each in found for difference in each)
    assert "States and commands are the same, bit for bit" in happened(runs, found)


def test_flights_that_differ_are_said_to_differ_most_somewhere(quiet, loud):
    runs = reported_runs([quiet, loud])
    found = by_panel(runs)
    assert "The flights differ most in" in happened(runs, list(found.values()))
    assert found["level"][0].share > 0.01


def test_only_steps_that_both_have_are_compared(quiet, bags):
    short = record_flight(bags / "short", duration=4.0, fault=3.0)
    (altitude,) = by_panel(reported_runs([short, quiet]))["altitude"]
    state = [bag.columns("/hsv/state") for bag in (short, quiet)]
    assert len(altitude.y) == len(state[0]["altitude"]) < len(state[1]["altitude"])
    assert altitude.time[-1] == state[0]["header.stamp"][-1] * 1e-9
