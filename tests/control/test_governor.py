import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.control import governor
from hsv.control.design_file import find_design, read_design
from hsv.control.governor import KEPT_FREE, Governor, InputBounds, Leg, legs_of
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.errors import GovernorError
from hsv.vehicle.trim import trim
from hsv.vehicle.vehicle import load_vehicle

DESIGN = read_design(find_design("baseline"))
VEHICLE, PERIOD = load_vehicle().decoupled, DESIGN.period
START, TARGET = (26060.4, 2407.92), (26243.28, 2484.12)
LOW, HIGH = DESIGN.plan_bounds.input_minimum, DESIGN.plan_bounds.input_maximum
BLEND = 4.0


def govern(*legs, blend=BLEND, minimum=LOW, maximum=HIGH, rate=(np.inf, np.inf)):
    bounds = InputBounds(np.array(minimum), np.array(maximum), np.array(rate))
    return Governor(nominal_data(DESIGN), VEHICLE, PERIOD, bounds).govern(START, legs, blend)


@pytest.fixture(scope="module")
def step():
    return govern(Leg(0.0, 0.0, *TARGET))


SHORT_BLEND = 0.2
NEAR = tuple(start + 3e-4 * (target - start) for start, target in zip(START, TARGET, strict=True))
"""So near that half a second is enough: planned in moments, without compilation, too."""
TRIM = trim(VEHICLE, *START).input
NARROW = {"minimum": TRIM - np.array([0.1, 0.01]), "maximum": TRIM + np.array([0.1, 0.01])}


@pytest.fixture(scope="module")
def short_step():
    return govern(Leg(0.0, 0.0, *NEAR), blend=SHORT_BLEND, **NARROW)


def problem(length, minimum=NARROW["minimum"], maximum=NARROW["maximum"], rate=(np.inf, np.inf), target=NEAR):
    """What is wrong with a ramp to a point near the start, of so many periods."""
    half = round(SHORT_BLEND / PERIOD)
    governor = Governor(nominal_data(DESIGN), VEHICLE, PERIOD, InputBounds(minimum, maximum, np.array(rate)))
    return governor._problem([(half, *START), (half + length, *target)], half)


def test_legs_are_what_the_commands_ask_for():
    assert legs_of(START, [0.0], [TARGET[0]], [TARGET[1]]) == [Leg(0.0, 0.0, *TARGET)]
    ramp = legs_of(START, [20.0, 80.0], [START[0], TARGET[0]], [START[1], TARGET[1]])
    assert ramp == [Leg(20.0, 60.0, *TARGET)]
    step = legs_of(START, [5.0, 5.0], [START[0], TARGET[0]], [START[1], TARGET[1]])
    assert step == [Leg(5.0, 0.0, *TARGET)]
    assert legs_of(START, [0.0], [START[0]], [START[1]]) == []


def test_what_is_wrong_with_a_plan_is_told():
    low, high = NARROW["minimum"], NARROW["maximum"]
    assert problem(50) == ""
    needs = r"the plan needs fuel_equivalence_ratio from 0\.\d+ to 0\.\d+, expected 0\.\d+ to 0\.\d+, U minus F Z"
    assert re.fullmatch(needs, problem(50, low, [TRIM[0] + 1e-3, high[1]]))
    assert re.fullmatch(needs, problem(50, [TRIM[0] - 1e-3, low[1]], high))
    assert problem(50, low, [high[0], TRIM[1] + 1e-4]).startswith("the plan needs elevator_deflection from ")
    moves = r"the plan moves elevator_deflection by 0\.\d+ rad/s, expected at most 0\.01, the limit of its actuator"
    assert re.fullmatch(moves, problem(50, rate=[np.inf, 0.01]))
    moves = r"the plan moves fuel_equivalence_ratio by 0\.\d+ 1/s, expected at most 0\.01, the limit of its actuator"
    assert re.fullmatch(moves, problem(50, rate=[0.01, np.inf]))
    assert "climb rate = " in problem(1, target=(START[0] + 200.0, START[1]))


@pytest.mark.compiled
def test_a_step_becomes_the_shortest_ramp_whose_plan_is_inside_the_tightened_inputs(step):
    assert step.times[0] == step.blend == BLEND
    assert (step.altitudes, step.velocities) == tuple(zip(START, TARGET, strict=True))
    room = np.minimum(step.plan.min(axis=0) - LOW, HIGH - step.plan.max(axis=0)) / (HIGH - LOW)
    # Nothing but the share that is kept free, and what a period's length changes.
    assert KEPT_FREE <= room.min() < KEPT_FREE + 5e-4


@pytest.mark.compiled
def test_less_room_makes_it_slower_and_more_faster(step):
    lower, higher = (govern(Leg(0.0, 0.0, *TARGET), maximum=HIGH + np.array([0.0, by])) for by in (-0.005, 0.005))
    assert lower.end > step.end > higher.end


def test_the_shortest_ramp_is_found_to_the_period(short_step):
    assert short_step.times[0] == short_step.blend == SHORT_BLEND
    assert (short_step.altitudes, short_step.velocities) == tuple(zip(START, NEAR, strict=True))
    assert short_step.end == short_step.times[-1] + SHORT_BLEND
    periods = round((short_step.times[-1] - short_step.times[0]) / PERIOD)
    assert periods > 10
    assert problem(periods) == ""
    assert problem(periods - 1).startswith("the plan needs elevator_deflection from ")


def test_legs_that_fit_begin_when_they_are_asked_for_or_when_the_one_before_is_done():
    legs = (Leg(0.5, 1.5, *NEAR), Leg(0.6, 1.5, *START), Leg(4.0, 1.5, *NEAR))
    found = govern(*legs, blend=SHORT_BLEND, **NARROW)
    assert found.times == (0.2, 0.7, 2.2, 3.7, 4.2, 5.7)
    assert found.end == pytest.approx(5.9)
    assert found.altitudes == (START[0], START[0], NEAR[0], START[0], START[0], NEAR[0])
    assert found.velocities == (START[1], START[1], NEAR[1], START[1], START[1], NEAR[1])


def test_a_leg_for_which_nothing_fits_is_refused(monkeypatch):
    monkeypatch.setattr(governor, "LONGEST", 0.3)
    why = r"command 1: no reference to 26060\.5 m and 2407\.94 m/s fits, not one of 0\.3 s either: the plan needs elev"
    with pytest.raises(GovernorError, match=why):
        govern(Leg(0.0, 0.0, *NEAR), blend=SHORT_BLEND, **NARROW)


def test_a_short_plan_too_is_that_of_its_reference(short_step):
    check_plan(short_step)
    assert len(short_step.plan) == round((short_step.end + 10.0) / PERIOD)


@pytest.mark.compiled
def test_the_plan_is_that_of_the_reference_it_returns(step):
    check_plan(step)
    assert np.abs(step.deviation[-1, :2]).max() < 0.1  # it has come to rest


def check_plan(step):
    reference = ReferenceTrajectory(step.times, step.altitudes, step.velocities, PERIOD, VEHICLE, blend=step.blend).data
    rows = np.clip(np.arange(len(step.plan)) - reference.first, 0, len(reference.state) - 1)
    assert np.all(step.deviation[0] == 0.0)
    # Step by step, because without its feedback the vehicle is unstable.
    for k, row in enumerate(rows[:-1]):
        x, u = step.deviation[k], step.plan[k] - reference.input[row]
        A, B = DESIGN.polytope.at(*(reference.state[row] + x)[:2])
        assert_allclose(step.deviation[k + 1], A @ x + B @ u + reference.defect[row], rtol=1e-9, atol=1e-9)


@pytest.mark.compiled
def test_a_ramp_is_never_faster_than_it_was_asked_for(step):
    slow = govern(Leg(20.0, 60.0, *TARGET))
    assert slow.times == (BLEND, 20.0 + BLEND, 80.0 + BLEND)
    fast = govern(Leg(20.0, 5.0, *TARGET))
    assert fast.times[-1] - fast.times[-2] == pytest.approx(step.times[-1] - step.times[-2], abs=2 * PERIOD)


@pytest.mark.compiled
def test_a_leg_begins_when_it_is_asked_for_or_when_the_one_before_is_done(step):
    soon = govern(Leg(0.0, 0.0, *TARGET), Leg(10.0, 0.0, *START))
    late = govern(Leg(0.0, 0.0, *TARGET), Leg(100.0, 0.0, *START))
    assert soon.times[:2] == late.times[:2] == step.times
    assert len(soon.times) == 3
    assert late.times[2] == 100.0 + BLEND
    assert late.altitudes == (START[0], TARGET[0], TARGET[0], START[0])


@pytest.mark.compiled
def test_the_rates_of_the_actuators_are_kept(step):
    fastest = np.abs(np.diff(step.plan, axis=0)).max(axis=0) / PERIOD
    limited = govern(Leg(0.0, 0.0, *TARGET), rate=0.5 * fastest)
    assert limited.end > step.end
    assert np.all(np.abs(np.diff(limited.plan, axis=0)).max(axis=0) <= 0.5 * fastest * PERIOD)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"maximum": [1.3, 0.21]}, r"the plan needs elevator_deflection from .* rad, expected .* U minus F Z"),
        ({"rate": [1e-6, np.inf]}, r"moves fuel_equivalence_ratio by .* 1/s, expected at most 1e-06, the limit of its"),
    ],
)
def test_a_command_for_which_nothing_fits_is_refused_with_the_reason(changes, why):
    with pytest.raises(GovernorError, match=r"command 1: no reference to 26243.3 m and 2484.12 m/s fits, .*" + why):
        govern(Leg(0.0, 0.0, *TARGET), **changes)


def test_no_command_and_no_blend_are_refused():
    with pytest.raises(GovernorError, match="command: none, expected one"):
        govern()
    with pytest.raises(GovernorError, match="blend = 0 s: expected above 0"):
        govern(Leg(0.0, 0.0, *TARGET), blend=0.0)
