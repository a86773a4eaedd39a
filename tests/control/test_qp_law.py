import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solve_discrete_are

from hsv.base.errors import DesignError, ParameterError
from hsv.control.design_file import find_design, read_design
from hsv.control.nominal_law import NOT_IN_FAMILY, FamilyLaw, NominalStatus
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_data
from hsv.control.qp_law import BLOCK_TIME, BLOCKS, CHECKED_FAR, CHECKED_NEAR, NEAR_BLOCKS, QpLaw
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

PATH = find_design("baseline")
DESIGN = read_design(PATH)
DATA = nominal_data(DESIGN)
START, REFERENCE = trim(load_vehicle().coupled(), 26060.4, 2407.92), trim(load_vehicle().coupled(), 26243.28, 2484.12)
TRAJECTORY = ReferenceTrajectory([0.0], [26243.28], [2484.12], DESIGN.period, load_vehicle().decoupled)
STEP = START.state - REFERENCE.state
BOUNDS = DESIGN.plan_bounds
MINIMUM, MAXIMUM = BOUNDS.lower, BOUNDS.upper
FAR = 100.0 * STEP


@pytest.fixture
def law():
    return QpLaw(DESIGN, DATA, TRAJECTORY)


def rigid():
    A, B = DESIGN.polytope.at(*REFERENCE.state[:2])
    return A[:5, :5], B[:5]


def predicted(law, deviation, plan):
    """Return the inputs (1000, 2) of a plan, predicted step by step with the model at the reference."""
    A, B = rigid()
    x, inputs = deviation[:5], []
    for k in range(BLOCKS * 25):
        u = law.gain[:, :5] @ x + plan[k // 25]
        inputs.append(u)
        x = A @ x + B @ u
    return np.array(inputs)


def test_far_from_the_bounds_it_is_the_linear_quadratic_regulator(law):
    A, B = rigid()
    Q, R = 0.02 * np.diag(DESIGN.nominal_state_scale**-2.0), 0.02 * np.diag(DESIGN.nominal_input_scale**-2.0)
    P = solve_discrete_are(A, B, Q, R)
    K = -np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    small = 0.002 * STEP
    result = law.step(small)
    assert_allclose(result.input, K @ small[:5], rtol=1e-6)
    assert (result.gain_index, result.status) == (NOT_IN_FAMILY, NominalStatus.OK)


def test_plan_of_the_step_keeps_the_bounds_between_block_ends_too(law):
    plan = law._solve(STEP[:5])
    inputs = predicted(law, STEP, plan)
    lower, upper = MINIMUM - REFERENCE.input, MAXIMUM - REFERENCE.input
    excess = np.maximum(lower - inputs, inputs - upper)
    near = 25 * NEAR_BLOCKS
    assert excess[:near, 0].max() < 1e-3 and np.degrees(excess[:near, 1].max()) < 0.1
    # Later in the horizon the bounds are imposed at fewer points; this part is planned again before it takes effect.
    assert excess[near:-25, 0].max() < 2e-3 and np.degrees(excess[near:-25, 1].max()) < 0.5
    assert np.isclose(inputs[:near, 0].max(), upper[0], atol=1e-6)
    A, B = rigid()
    low, high = BOUNDS.pitch_acceleration
    x, first = STEP[:5], []
    for u in inputs[:250]:
        new = A @ x + B @ u
        first.append((new[4] - x[4]) / 0.02)
        x = new
    room = 0.05 * (high - low)
    assert min(first) > low - room and max(first) < high + room
    assert max(first) > high - room


def test_bounds_are_imposed_at_control_steps():
    steps = np.array([*CHECKED_NEAR, *CHECKED_FAR]) * BLOCK_TIME / DESIGN.period
    assert_allclose(steps, steps.round())


def test_where_the_solver_fails_the_plan_before_goes_on_and_then_the_family(law):
    plan = law._solve(STEP[:5])
    law.step(STEP)
    lower, upper = MINIMUM - REFERENCE.input, MAXIMUM - REFERENCE.input
    for age in range(1, 30):
        result = law.step(FAR)
        assert result.status == NominalStatus.SOLVER_FAILED
        assert np.array_equal(result.input, np.clip(law.gain @ FAR + plan[age // 25], lower, upper))
    law._age = 748
    assert law.step(FAR).status == NominalStatus.SOLVER_FAILED
    result = law.step(FAR)
    assert result.status == NominalStatus.SOLVER_FAILED | NominalStatus.FAMILY_FALLBACK | NominalStatus.OUTSIDE_FAMILY
    assert np.array_equal(result.input, FamilyLaw(DATA).step(FAR).input)
    assert law.step(STEP).status == NominalStatus.OK


def test_without_a_plan_a_failure_flies_the_family(law):
    law.step(STEP)
    law.reset()
    assert NominalStatus.FAMILY_FALLBACK in law.step(FAR).status
    assert NominalStatus.SOLVER_FAILED in law.step(np.full(9, np.nan)).status


def test_bounds_are_needed_and_must_hold_the_reference():
    with pytest.raises(DesignError, match="expected inside the plan bounds"):
        moved = dataclasses.replace(BOUNDS, input_minimum=REFERENCE.input + 0.01)
        QpLaw(dataclasses.replace(DESIGN, plan_bounds=moved), DATA, TRAJECTORY)
    with pytest.raises(DesignError, match=r"nominal.input_minimum: empty, expected U minus F Z"):
        NominalTrajectory.from_parameters({"nominal.law": "qp"}, dataclasses.replace(DESIGN, plan_bounds=None))
    with pytest.raises(ParameterError, match=r"nominal.law = 'lucky'"):
        NominalTrajectory.from_parameters({"nominal.law": "lucky"}, DESIGN)
