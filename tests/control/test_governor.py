import re
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import GovernorError
from hsv.control.design import PlanBounds
from hsv.control.design_file import find_design, read_design
from hsv.control.governor import AT_REST, LEAD_TIME, MARGIN_SHARE, Beginning, Governor, Leg, command_in_flight, legs_of
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_data
from hsv.control.reference_trajectory import Corner, ReferenceTrajectory
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

DESIGN = read_design(find_design("baseline"))
VEHICLE, PERIOD = load_vehicle().decoupled, DESIGN.period
START, TARGET = (26060.4, 2407.92), (26243.28, 2484.12)
LOW, HIGH = DESIGN.plan_bounds.input_minimum, DESIGN.plan_bounds.input_maximum
BLEND = 4.0


def governor(minimum, maximum, rate=(np.inf, np.inf)):
    bounds = PlanBounds(np.array(minimum), np.array(maximum), np.empty(3), np.empty(3))
    return Governor(nominal_data(DESIGN), VEHICLE, PERIOD, bounds, np.array(rate))


def govern(*legs, blend=BLEND, minimum=LOW, maximum=HIGH, rate=(np.inf, np.inf)):
    return governor(minimum, maximum, rate).govern(START, legs, blend)


@pytest.fixture(scope="module")
def step():
    return govern(Leg(0.0, 0.0, *TARGET))


SHORT_BLEND = 0.2
NEAR = tuple(start + 3e-4 * (target - start) for start, target in zip(START, TARGET, strict=True))
"""A target so near that half a second is enough and planning takes only moments."""
TRIM = trim(VEHICLE, *START).input
NARROW = {"minimum": TRIM - np.array([0.1, 0.01]), "maximum": TRIM + np.array([0.1, 0.01])}


@pytest.fixture(scope="module")
def short_step():
    return govern(Leg(0.0, 0.0, *NEAR), blend=SHORT_BLEND, **NARROW)


def problem(length, minimum=NARROW["minimum"], maximum=NARROW["maximum"], rate=(np.inf, np.inf), target=NEAR):
    """Return why a ramp of ``length`` periods to a point near the start does not fit; empty if it does."""
    corners = (SHORT_BLEND, *START), (SHORT_BLEND + length * PERIOD, *target)
    return governor(minimum, maximum, rate)._problem([Corner(*corner, SHORT_BLEND) for corner in corners], AT_REST)


def column(found, name):
    """Return one field of all corners of a reference: time, altitude, velocity or blend."""
    return tuple(getattr(corner, name) for corner in found.corners)


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


def test_a_step_becomes_the_shortest_ramp_whose_plan_is_inside_the_tightened_inputs(step):
    assert column(step, "time")[0] == step.blend == BLEND
    assert (column(step, "altitude"), column(step, "velocity")) == tuple(zip(START, TARGET, strict=True))
    room = np.minimum(step.plan.min(axis=0) - LOW, HIGH - step.plan.max(axis=0)) / (HIGH - LOW)
    # Apart from the reserved share of the range, only the effect of one period more or less remains.
    assert MARGIN_SHARE <= room.min() < MARGIN_SHARE + 5e-4


def test_the_shortest_ramp_is_found_to_the_period(short_step):
    assert column(short_step, "time")[0] == short_step.blend == SHORT_BLEND
    assert (column(short_step, "altitude"), column(short_step, "velocity")) == tuple(zip(START, NEAR, strict=True))
    assert short_step.end == column(short_step, "time")[-1] + SHORT_BLEND
    first, last = column(short_step, "time")
    periods = round((last - first) / PERIOD)
    assert periods > 10
    assert problem(periods) == ""
    assert problem(periods - 1).startswith("the plan needs elevator_deflection from ")


def test_legs_that_fit_begin_when_they_are_asked_for_or_when_the_one_before_is_done():
    legs = (Leg(0.5, 1.5, *NEAR), Leg(0.6, 1.5, *START), Leg(4.0, 1.5, *NEAR))
    found = govern(*legs, blend=SHORT_BLEND, **NARROW)
    assert column(found, "time") == (0.2, 0.7, 2.2, 3.7, 4.2, 5.7)
    assert found.end == pytest.approx(5.9)
    assert column(found, "altitude") == (START[0], START[0], NEAR[0], START[0], START[0], NEAR[0])
    assert column(found, "velocity") == (START[1], START[1], NEAR[1], START[1], START[1], NEAR[1])


def test_the_plan_is_that_of_the_reference_it_returns(short_step):
    step = short_step
    assert len(step.plan) == round((step.end + 10.0) / PERIOD)
    times, altitudes, velocities, blends = zip(*step.corners, strict=True)
    reference = ReferenceTrajectory(times, altitudes, velocities, PERIOD, VEHICLE, blend=blends).data
    rows = np.clip(np.arange(len(step.plan)) - reference.first, 0, len(reference.state) - 1)
    assert np.all(step.deviation[0] == 0.0)
    # Step by step, because the vehicle is unstable without its feedback.
    for k, row in enumerate(rows[:-1]):
        x, u = step.deviation[k], step.plan[k] - reference.input[row]
        A, B = DESIGN.polytope.at(*(reference.state[row] + x)[:2])
        assert_allclose(step.deviation[k + 1], A @ x + B @ u + reference.defect[row], rtol=1e-9, atol=1e-9)


def test_a_ramp_is_never_faster_than_it_was_asked_for(step):
    slow = govern(Leg(20.0, 60.0, *TARGET))
    assert column(slow, "time") == (BLEND, 20.0 + BLEND, 80.0 + BLEND)
    fast = govern(Leg(20.0, 5.0, *TARGET))
    *_, begin, end = column(fast, "time")
    assert end - begin == pytest.approx(np.ptp(column(step, "time")), abs=2 * PERIOD)


IN_FLIGHT = 100
"""Step at which a command is received."""
SHARP = [Corner(0.0, *START, 0.0), Corner(1.0, *START, 0.0), Corner(1.0, *NEAR, 0.0), Corner(4.0, *START, 0.0)]
"""A step, followed by a ramp without blending that has not begun."""


def test_what_is_flown_stays_as_it_is_when_a_leg_is_added():
    narrow = governor(**NARROW)
    deviation = np.array([0.5, 0.01, *np.zeros(7)])
    for known in ([Corner(0.0, *START, 0.0)], SHARP):
        found, first = narrow.continued(known, Leg(0.0, 1.5, *NEAR), SHORT_BLEND, Beginning(IN_FLIGHT, deviation))
        # The reference turns at the next step, or at the end of the last corner that is already planned.
        assert first == (IN_FLIGHT if len(known) == 1 else 200 + 1 - 10)
        assert list(found.corners[: len(known)]) == known
        assert found.end == pytest.approx((first + 10) * PERIOD + 1.5 + SHORT_BLEND)
        assert found.corners[-1][1:] == (*NEAR, SHORT_BLEND)
        assert np.array_equal(found.deviation[0], deviation)
        before, after = (narrow.trajectory(corners) for corners in (known, found.corners))
        rows = [trajectory.rows(500) for trajectory in (before, after)]
        pairs = ((getattr(each.data, name) for each in (before, after)) for name in ("state", "input", "defect"))
        for one, other in pairs:
            assert np.array_equal(one[rows[0]][:first], other[rows[1]][:first])
            assert not np.array_equal(one[rows[0]][first : first + 2], other[rows[1]][first : first + 2])


def flying(values=None, design=DESIGN, steps=IN_FLIGHT):
    """Return a nominal trajectory after some steps of level flight at the start, and a function that commands it."""
    reference = ReferenceTrajectory([0.0], *([value] for value in START), PERIOD, VEHICLE)
    trajectory = NominalTrajectory(design, reference)
    for _ in range(steps):
        trajectory.step(reference.final_state)
    return trajectory, partial(command_in_flight, values or {}, design, trajectory)


def test_a_command_in_flight_is_flown_and_forgotten_with_the_run():
    trajectory, command = flying()
    planned = trajectory.reference
    notice = round(LEAD_TIME / PERIOD)
    first, plan = command(NEAR, duration=1.5, blend=SHORT_BLEND)
    assert first == IN_FLIGHT + notice
    # The flight continues during planning.
    flown = [trajectory.step(planned.final_state).reference[:2] for _ in range(notice)]
    reference = plan()
    assert reference.end == pytest.approx((first + 10) * PERIOD + 1.5 + SHORT_BLEND)
    trajectory.change_reference(reference)
    flown += [trajectory.step(planned.final_state).reference[:2] for _ in range(120)]
    assert np.array_equal(flown[: notice + 1], [START] * (notice + 1)) and np.array_equal(flown[-1], NEAR)
    next_first, _ = command(START, duration=1.5, blend=SHORT_BLEND)
    assert next_first == first + 120 + notice
    trajectory.reset()
    assert trajectory.reference is planned and trajectory.next_step == 0


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ((60960.0, 2450.0), r"altitude = 60960 m: expected 25908 to 26365\.2 m"),
        ((26100.0, np.nan), r"velocity = nan m/s: expected 2346\.96 to 2529\.84 m/s"),
        ((26100.0, 2450.0, -1.0), r"duration = -1 s: expected 0 to 600 s"),
        ((26100.0, 2450.0, 0.0, np.inf), r"blend = inf s: expected 0 to 600 s"),
        (START, r"altitude = 26060\.4 m, velocity = 2407\.92 m/s: expected another point than the command before"),
    ],
)
def test_a_wrong_command_changes_nothing(words, why):
    trajectory, command = flying(steps=1)
    planned = trajectory.reference
    with pytest.raises(GovernorError, match=why):
        command(words[:2], *words[2:])
    assert trajectory.reference is planned


def test_only_a_certified_plan_in_flight_can_be_commanded():
    trajectory, command = flying(steps=0)
    with pytest.raises(GovernorError, match=r"no step is flown yet: expected a command in flight"):
        command(NEAR)
    for values, design, why in (
        ({}, None, r"design = 'none': expected one that has tightened inputs"),
        ({"nominal.law": "qp"}, DESIGN, r"nominal\.law = 'qp': expected 'family'"),
        ({"reference.trim": "static"}, DESIGN, r"reference\.trim = 'static': expected 'climbing'"),
    ):
        with pytest.raises(GovernorError, match=why):
            command_in_flight(values, design, trajectory, NEAR)
