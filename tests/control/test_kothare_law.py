import time

import numpy as np
import pytest

from hsv.control.design import find_design, read_design
from hsv.control.nominal_gain import NominalProblem, nominal_gain
from hsv.control.nominal_law import NOT_IN_FAMILY, SOLVE_STEPS, FamilyLaw, KothareLaw, NominalStatus
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_data
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

DESIGN = read_design(find_design("baseline"))
DATA = nominal_data(DESIGN)
START, REFERENCE = trim(load_vehicle().coupled(), 26060.4, 2407.92), trim(load_vehicle().coupled(), 26243.28, 2484.12)
TRAJECTORY = ReferenceTrajectory([0.0], [26243.28], [2484.12], DESIGN.period, load_vehicle().decoupled)
STEP = START.state - REFERENCE.state


def fly(steps, pause=0.0):
    """Results of a nominal flight, the nominal state measured."""
    trajectory = NominalTrajectory(DESIGN, TRAJECTORY, KothareLaw(DESIGN, DATA))
    results, measured = [], START.state
    for _ in range(steps):
        results.append(trajectory.step(measured))
        measured = results[-1].reference + results[-1].deviation
        time.sleep(pause)
    return results


@pytest.fixture(scope="module")
def flight():
    return fly(2 * SOLVE_STEPS + 1)


def test_gain_takes_effect_exactly_when_it_should(flight):
    assert [r.gain_index == NOT_IN_FAMILY for r in flight] == [k >= SOLVE_STEPS for k in range(len(flight))]
    assert np.array_equal(flight[SOLVE_STEPS].gain, flight[2 * SOLVE_STEPS - 1].gain)
    assert not np.array_equal(flight[SOLVE_STEPS].gain, flight[2 * SOLVE_STEPS].gain)
    assert all(r.status == NominalStatus.OK for r in flight)
    assert all(np.allclose(r.input, r.gain @ r.deviation, rtol=1e-12, atol=1e-15) for r in flight)


def test_gain_is_that_of_the_state_at_the_start_of_the_solve(flight):
    scales = DESIGN.nominal_state_scale, DESIGN.nominal_input_scale, DESIGN.nominal_input_bound
    problem = NominalProblem(DESIGN.polytope.A[:, :5, :5], DESIGN.polytope.B[:, :5], DESIGN.period, *scales)
    found = nominal_gain(problem, 1.02 * flight[SOLVE_STEPS].deviation[:5])
    assert np.array_equal(found.K, flight[2 * SOLVE_STEPS].gain[:, :5])


def test_two_flights_are_bit_identical_whatever_the_pace(flight):
    slow = fly(len(flight), pause=0.01)
    for one, other in zip(flight, slow, strict=True):
        assert np.array_equal(one.input, other.input) and np.array_equal(one.gain, other.gain)


def test_a_failed_solve_leaves_the_family():
    law, far = KothareLaw(DESIGN, DATA), 30.0 * STEP
    results = [law.step(far) for _ in range(SOLVE_STEPS + 1)]
    failed = NominalStatus.SOLVER_FAILED | NominalStatus.FAMILY_FALLBACK
    assert results[-2].status == NominalStatus.OUTSIDE_FAMILY
    assert results[-1].status == failed | NominalStatus.OUTSIDE_FAMILY
    assert np.array_equal(results[-1].input, FamilyLaw(DATA).step(far).input)


def test_a_gain_that_no_longer_fits_is_not_taken():
    law, far = KothareLaw(DESIGN, DATA), 30.0 * STEP
    for _ in range(SOLVE_STEPS):
        law.step(STEP)
    refused = law.step(far)
    assert refused.status == NominalStatus.SOLVER_FAILED | NominalStatus.FAMILY_FALLBACK | NominalStatus.OUTSIDE_FAMILY
    for _ in range(2 * SOLVE_STEPS):  # the solve for the far state fails, the next does not
        good = law.step(STEP)
    assert (good.gain_index, good.status) == (NOT_IN_FAMILY, NominalStatus.OK)
    for _ in range(SOLVE_STEPS - 1):
        law.step(STEP)
    kept = law.step(far)
    assert (kept.gain_index, kept.status) == (NOT_IN_FAMILY, NominalStatus.SOLVER_FAILED)
    assert np.array_equal(kept.gain, good.gain)


def test_near_the_reference_nothing_is_solved_and_reset_returns_to_the_family():
    law = KothareLaw(DESIGN, DATA)
    for _ in range(SOLVE_STEPS + 1):
        result = law.step(STEP)
    assert result.gain_index == NOT_IN_FAMILY
    law.reset()
    near = 0.01 * STEP
    results = [law.step(near) for _ in range(SOLVE_STEPS + 1)]
    assert all(r.gain_index == len(DATA.gains) - 1 and r.status == NominalStatus.OK for r in results)
