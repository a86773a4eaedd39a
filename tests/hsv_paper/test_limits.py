"""Fastest transfer and deepest fault by optimal control; the long tests recompute the page's numbers."""

from pathlib import Path

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.flight.assembly import assemble, assemble_flight, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import corners
from hsv.flight.governed import governed
from hsv.flight.scenario import load_scenario, parse_scenario
from hsv.model.dynamics import advance, transitions
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.limits import optimum
from hsv_paper.limits.optimum import INPUT_SCALE, STATE_SCALE, curvatures
from hsv_paper.limits.problems import (
    at_trim,
    envelope_points,
    recovery,
    static_limit,
    straight,
    transfer,
    turning_limit,
)
from hsv_paper.limits.study import BLEND, PERIODS, deepest_fault, fastest_transfer, settling_times
from hsv_paper.linear_loop import START, TARGET

ROOT = Path(__file__).parents[2]
ENVELOPE = load_vehicle()
VEHICLE = ENVELOPE.coupled("paper_like")
HORIZON = 8.0
LEAST_TIME = 10.01


def disturbed(count, seed=1):
    """Return random states (count, 9) and inputs (count, 2) about the trim, periods (s) and numbers of substeps."""
    random = np.random.default_rng(seed)
    point = trim(VEHICLE, *TARGET)
    state = point.state + random.uniform(-1.0, 1.0, (count, 9)) * STATE_SCALE
    inputs = point.input + random.uniform(-1.0, 1.0, (count, 2)) * INPUT_SCALE
    return state, inputs, random.uniform(0.02, 0.1, count), random.integers(2, 10, count)


def slope_along(j, reach, part, state, inputs, period, substeps):
    """Return the central difference of a part of ``transitions`` along state, input or period ``j``."""
    change = np.zeros(12)
    change[j] = reach
    above, below = (
        transitions(state + s * change[:9], inputs + s * change[9:11], period + s * change[11], substeps, VEHICLE)[part]
        for s in (1.0, -1.0)
    )
    return (above - below) / (2.0 * reach)


def test_transitions_are_those_of_the_flights_integrator_with_its_derivatives():
    state, inputs, period, substeps = disturbed(4)
    end, slope = transitions(state, inputs, period, substeps, VEHICLE)
    for k in range(4):
        x = advance(state[k], inputs[k], VEHICLE, period[k], int(substeps[k]))
        assert end[k] == pytest.approx(x, rel=1e-14, abs=1e-14)
    for j, size in enumerate((*STATE_SCALE, *INPUT_SCALE, 0.02)):
        difference = slope_along(j, 1e-4 * size, 0, state, inputs, period, substeps)
        assert size * slope[:, :, j] / STATE_SCALE == pytest.approx(size * difference / STATE_SCALE, abs=1e-6)


def test_curvature_is_the_change_of_the_derivatives():
    state, inputs, period, substeps = disturbed(3)
    weights = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 9)) / STATE_SCALE
    found = curvatures(state, inputs, period, substeps, VEHICLE, weights)
    assert found == pytest.approx(found.transpose(0, 2, 1))
    scale = np.array([*STATE_SCALE, *INPUT_SCALE, 0.02])
    for j in (2, 4, 9, 10, 11):
        slope = slope_along(j, 1e-3 * scale[j], 1, state, inputs, period, substeps)
        difference = np.einsum("ki,kij->kj", weights, slope)
        curved = [0, 1, 2, 3, 4, 9, 10, 11]
        assert (found[:, j] * scale * scale[j])[:, curved] == pytest.approx(
            (difference * scale * scale[j])[:, curved], abs=1e-6
        )


@pytest.mark.long
def test_the_deepest_fault_known_after_a_fifth_of_a_second():
    """At the optimum, full elevator without fuel just turns the nose, to the resolution of the bisection."""
    problem = recovery(VEHICLE, ENVELOPE, 0.2, HORIZON)
    found = problem.solve(at_trim(problem), 1e-4)
    assert found.scalar == pytest.approx(turning_limit(VEHICLE, 0.2), abs=2e-4)
    assert np.abs(problem.defects(found)).max() < optimum.DEFECT
    low, high = problem.inputs + found.scalar * problem.inputs_slope
    assert np.all(found.input >= low - 1e-8) and np.all(found.input <= high + 1e-8)


def test_an_iteration_that_ends_early_is_refused(monkeypatch):
    monkeypatch.setattr(optimum, "_ITERATIONS", 2)
    problem = recovery(VEHICLE, ENVELOPE, 0.2, 2.0)
    with pytest.raises(DesignError, match="optimal control: after 2 iterations the largest defect"):
        problem.solve(at_trim(problem))


def test_static_limits_are_those_of_trims():
    """At the target 0.41; the fastest and lowest point of the envelope needs the least effectiveness."""
    at_target = static_limit(VEHICLE, np.array([TARGET]))
    assert at_target == pytest.approx(0.4064, abs=1e-4)
    points = envelope_points(ENVELOPE)
    assert len(points) == 9
    best = min(points, key=lambda point: static_limit(VEHICLE, point[None]))
    assert best == pytest.approx([ENVELOPE.altitude_range[0], ENVELOPE.velocity_range[1]])
    assert static_limit(VEHICLE, points) == static_limit(VEHICLE, best[None]) < at_target
    # There is no trim at a velocity that no amount of fuel can hold.
    assert static_limit(VEHICLE, np.array([[TARGET[0], 3.0 * TARGET[1]]])) == np.inf


def test_each_delay_costs_effectiveness():
    limits = [turning_limit(VEHICLE, delay) for delay in (0.0, 0.1, 0.2, 0.3)]
    assert np.all(np.diff(limits) > 0.03)
    assert limits[1:3] == pytest.approx([0.4114, 0.4576], abs=2e-4)


@pytest.mark.long
def test_the_fastest_transfers_of_the_page():
    """Another first guess and another mesh change the times by less than 0.1 %."""
    rest = fastest_transfer(VEHICLE, PERIODS, settling=False)
    assert rest.found.scalar == pytest.approx(10.626, abs=2e-3)
    assert rest.change < 0.1
    assert np.abs(rest.problem.defects(rest.found)).max() < optimum.DEFECT
    other = transfer(VEHICLE, 50, settling=False)
    assert other.solve(straight(other, 30.0), 1e-4).scalar == pytest.approx(rest.found.scalar, rel=2e-3)

    settled = fastest_transfer(VEHICLE, PERIODS, settling=True)
    assert settled.found.scalar == pytest.approx(10.0125, abs=2e-3)
    assert round(settled.found.scalar, 2) == LEAST_TIME
    inside = settled.found.state[PERIODS:, :2]
    step = np.subtract(TARGET, START)
    assert np.all(np.abs(inside - TARGET) <= 0.02 * np.abs(step) * (1.0 + 1e-6))
    longer = transfer(VEHICLE, 50, settling=True, rest=0.8)
    assert longer.solve(straight(longer, 15.0), 1e-4).scalar == pytest.approx(settled.found.scalar, rel=2e-3)


@pytest.mark.long
def test_the_deepest_faults_of_the_page():
    """A mesh twice as fine changes the limits by less than 0.1 %."""
    for delay, expected in ((0.1, 0.4113), (0.2, 0.4576)):
        found = deepest_fault(VEHICLE, ENVELOPE, delay)
        assert found.found.scalar == pytest.approx(expected, abs=1e-4)
        assert found.change < 0.1
        assert turning_limit(VEHICLE, delay) == pytest.approx(found.found.scalar, abs=2e-4)
    at_once = deepest_fault(VEHICLE, ENVELOPE, 0.0)
    assert at_once.found.scalar == pytest.approx(0.4053, abs=1e-4)
    assert static_limit(VEHICLE, at_once.found.state[-1:, :2]) == pytest.approx(at_once.found.scalar, abs=1e-6)


@pytest.mark.long
def test_the_limits_of_all_corners():
    """Over all corners, the target's trim needs at most 0.4386, and turning after 0.2 s at most 0.491: below 0.5."""
    others = [VEHICLE.perturbed(corner) for corner in corners(ENVELOPE.uncertainty)[1:]]
    static = [static_limit(vehicle, np.array([TARGET])) for vehicle in others]
    turning = [turning_limit(vehicle, 0.2) for vehicle in others]
    assert (min(static), max(static)) == pytest.approx((0.3769, 0.4385), abs=1e-4)
    assert (min(turning), max(turning)) == pytest.approx((0.4264, 0.4908), abs=2e-4)
    worst = others[int(np.argmax(turning))]
    found = deepest_fault(worst, ENVELOPE, 0.2)
    assert found.found.scalar == pytest.approx(max(turning), abs=2e-4)


@pytest.mark.parametrize("page", ["study/limits.md", "comparison.md"])
def test_a_page_has_the_least_time(page):
    assert f"{LEAST_TIME} s" in (ROOT / "docs" / page).read_text(encoding="utf-8")


def flown(scenario, **changes):
    return fly(assemble({**flight_parameters(load_scenario(scenario)), **changes}))


def test_settling_times_of_a_ramp_count_from_its_beginning():
    """The values printed in docs/governor.md."""
    assert settling_times(flown("case1_governed")) == pytest.approx([29.0, 28.8], abs=0.05)


def test_the_page_has_what_the_controllers_reach():
    page_of_limits = (ROOT / "docs" / "study" / "limits.md").read_text(encoding="utf-8")
    flown = fly(assemble_flight(parse_scenario(governed("case1", BLEND).text, "case1")))
    assert f"{max(settling_times(flown)):.1f}" in page_of_limits
