"""Flights side by side have the same bits as alone, whatever flies in the other lanes."""

from itertools import cycle

import numpy as np
import pytest
from flights import components
from marking import long

from hsv.control.controller import ControllerInput
from hsv.core import lanes
from hsv.flight.closed_loop import fly
from hsv.flight.side_by_side import FlightGroup, TubeLevels

WIDTH = lanes()
SHORT = 112.0

pytestmark = pytest.mark.skipif(WIDTH == 1, reason="this processor flies one at a time")


def check(flights, group=None):
    """Assert that the flights are the same side by side and alone; return the flights alone."""
    assert FlightGroup.takes(flights)
    alone = [fly(own) for own in flights]
    group, levels = FlightGroup() if group is None else group, TubeLevels(flights[0])
    for (together, level), own in zip(group.fly(flights, levels.set), alone, strict=True):
        if levels.set:
            assert level == pytest.approx(levels.worst(own), rel=0, abs=0, nan_ok=True)
        for name in ("curves", "saturated"):
            assert np.array_equal(getattr(together, name), getattr(own, name), equal_nan=True), name
        assert together.fingerprint == own.fingerprint
        assert together.status == own.status and len(together.time) == len(own.time)
        for name, column in own.history.columns().items():
            assert np.array_equal(together.history.columns()[name], column, equal_nan=True), name
        assert together.metrics == own.metrics
    return alone


@pytest.mark.parametrize(
    "scenario",
    ["case2", *map(long, ("case1", "case1_smooth", "case1_integral_heavy", "case1_governed", "case1_active"))],
)
def test_corners_of_a_scenario_are_the_same_in_every_lane(scenario):
    names = ("mass", "moment_of_inertia", "lift_alpha", "moment_elevator", "natural_frequency_1")
    random = np.random.default_rng(3)
    parts = components(scenario, duration=SHORT)
    corners = [dict(zip(names, random.uniform(-0.1, 0.1, len(names)), strict=True)) for _ in range(WIDTH)]
    flown = check([parts.perturbed(corner) for corner in corners])
    assert len({own.fingerprint for own in flown}) == WIDTH


def test_a_flight_that_diverges_ends_alone_and_disturbs_no_other():
    parts = components("case1", duration=20.0)
    flown = check([parts.perturbed({"moment_elevator": -0.85 if i in (1, WIDTH - 1) else 0.0}) for i in range(WIDTH)])
    lengths = [len(own.time) for own in flown]
    assert lengths[1] == lengths[-1] < lengths[0] == 1001
    assert all(length == 1001 for i, length in enumerate(lengths) if i not in (1, WIDTH - 1))


def test_a_group_forgets_its_last_flights():
    parts, group = components("case1", duration=20.0), FlightGroup()
    ended = check([parts.perturbed({"moment_elevator": -0.85})] * WIDTH, group)
    assert max(len(own.time) for own in ended) < 1001
    assert {len(own.time) for own in check([parts.perturbed({"mass": 0.01 * i}) for i in range(3)], group)} == {1001}
    parts.plant.steps = 0
    assert len(check([parts.perturbed({"mass": 0.01 * i}) for i in range(WIDTH)], group)[0].time) == 1


COMMAND_FAULTS = (
    ("loss_of_effectiveness", "effectiveness=0.9"),
    ("loss_of_effectiveness", "effectiveness=0.8,ramp_time=1.0,random_on=0.3,random_off=0.2"),
    ("delay", "steps=2"),
    ("dead_zone", "width=0.002"),
    ("backlash", "width=0.002,intermittent_period=0.6"),
    ("loss_of_effectiveness", "effectiveness=0.7,random_on=0.1,random_off=0.4"),
    ("dead_zone", "width=0.001"),
    ("loss_of_effectiveness", "effectiveness=0.5"),
)


def test_faults_on_the_command_begin_and_act_in_each_lane_on_their_own():
    changes = [
        {"seed": 100 + i, "fault__starts": [2.0 + 0.5 * i], "fault__types": [kind], "fault__parameters": [text]}
        for i, (kind, text) in zip(range(WIDTH), cycle(COMMAND_FAULTS), strict=False)
    ]
    flown = check([components("case1", duration=12.0, **change) for change in changes])
    assert len({own.fingerprint for own in flown}) == WIDTH


def test_beginnings_references_and_factors_of_the_gain_may_differ():
    flights = [
        components(
            "case2",
            duration=30.0,
            feedback__tau=[0.9 + 0.005 * i],
            initial__altitude=26060.4 + i,
            reference__times=[0.0, 10.0 + i],
            reference__altitudes=[26100.0, 26243.28],
            reference__velocities=[2410.0 + i, 2484.12],
        )
        for i in range(WIDTH)
    ]
    check(flights)


@pytest.mark.parametrize("scenario", ["case1_qp", "case1_kothare_online"])
def test_laws_that_solve_in_flight_are_not_taken(scenario):
    parts = components(scenario, duration=1.0)
    assert not FlightGroup.takes([parts, parts.perturbed({"mass": 0.05})])


def test_flights_of_different_lengths_or_designs_are_not_taken():
    first = components("case1", duration=1.0)
    assert not FlightGroup.takes([first, components("case1", duration=2.0)])
    assert not FlightGroup.takes([first, components("case1_smooth", duration=1.0)])
    assert not FlightGroup.takes([first])


def published_levels(parts, flight):
    """Return the tube level that the controller publishes in each step."""
    h, notch, law = flight.history, parts.notch_filter, parts.controller
    for part in (notch, law):
        part.reset()
    levels = []
    references = zip(flight.reference, flight.reference_input, strict=True)
    rows = zip(h.state, h.deviation, h.nominal_input, references, strict=True)
    for k, (x, x_n, u_n, (x_r, u_r)) in enumerate(rows):
        filtered = notch.step(float(x[4]))
        q_f, s = filtered.filtered_pitch_rate, filtered.filter_state
        result = law.step(ControllerInput(k, x, q_f, x_r, u_r, x_n, u_n, s))
        levels.append(result.level)
    return levels


def test_the_worst_level_is_the_largest_that_the_controller_publishes_in_every_bit():
    parts = components("case1_heavy", duration=110.0)
    flight = fly(parts)
    worst = TubeLevels(parts).worst(flight)
    assert worst == max(published_levels(parts, flight))
