"""The nominal laws: the nested family, and the LMI solved in flight."""

import dataclasses
import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.control.design import find_design, read_design
from hsv.control.nominal_gain import NominalProblem, nominal_gain
from hsv.control.nominal_law import (
    MEMBERSHIP_TOLERANCE,
    NOT_IN_FAMILY,
    SOLVE_STEPS,
    FamilyLaw,
    KothareLaw,
    NominalStatus,
)
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_data
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

SMOOTH = read_design(find_design("smooth"))
SWITCHED = dataclasses.replace(SMOOTH, interpolated=False)
BOUNDARY = 1.0 + MEMBERSHIP_TOLERANCE


def level(index, x):
    return x[:5] @ SMOOTH.nominal_ellipsoids[index] @ x[:5]


def on_boundary(index, rng):
    """A state on the boundary of an ellipsoid, the elastic ones at rest."""
    direction = rng.normal(size=5)
    root = np.linalg.cholesky(np.linalg.inv(SMOOTH.nominal_ellipsoids[index]))
    return np.append(root @ (direction / np.linalg.norm(direction)), np.zeros(4)) * np.sqrt(BOUNDARY)


def step(design, x):
    return FamilyLaw(nominal_data(design)).step(x)


def test_without_gains_nothing_is_planned():
    none = replace(nominal_data(SMOOTH), gains=np.zeros((0, 2, 9)), ellipsoids=np.zeros((0, 5, 5)))
    result = FamilyLaw(none).step(np.ones(9))
    assert_array_equal(result.input, [0.0, 0.0])
    assert result.status is NominalStatus.OK
    assert len(result.gain) == 0


@pytest.mark.parametrize("index", range(1, len(SMOOTH.nominal_gains)))
def test_the_input_is_continuous_where_the_switched_one_jumps(index):
    rng = np.random.default_rng(index)
    largest = {"interpolated": 0.0, "switched": 0.0}
    for _ in range(20):
        x = on_boundary(index, rng)
        for name, design in (("interpolated", SMOOTH), ("switched", SWITCHED)):
            inner, outer = (step(design, (1.0 + side * 1e-9) * x) for side in (-1.0, 1.0))
            assert inner.gain_index >= index > outer.gain_index
            jump = np.abs(outer.input - inner.input) / SMOOTH.nominal_input_bound
            largest[name] = max(largest[name], jump.max())
    assert largest["interpolated"] < 1e-4 < 1e-3 < largest["switched"]


def test_between_two_ellipsoids_the_gain_is_the_one_whose_own_ellipsoid_has_the_state_on_its_boundary():
    rng = np.random.default_rng(1)
    last = len(SMOOTH.nominal_gains) - 1
    seen = set()
    for _ in range(300):
        x = rng.uniform() ** 2 * on_boundary(0, rng)
        result = step(SMOOTH, x)
        i = result.gain_index
        seen.add(i)
        if i == last:
            assert_allclose(result.input, SMOOTH.nominal_gains[i] @ x, rtol=1e-12, atol=1e-15)
            continue
        share = (level(i + 1, x) - BOUNDARY) / (level(i + 1, x) - level(i, x))
        assert 0.0 <= share <= 1.0
        mixed = share * SMOOTH.nominal_ellipsoids[i] + (1.0 - share) * SMOOTH.nominal_ellipsoids[i + 1]
        assert_allclose(x[:5] @ mixed @ x[:5], BOUNDARY, rtol=1e-9)
        K = share * SMOOTH.nominal_gains[i] + (1.0 - share) * SMOOTH.nominal_gains[i + 1]
        assert_allclose(result.input, K @ x, rtol=1e-6, atol=1e-12)
    assert len(seen) > 3


def test_every_input_of_the_family_keeps_its_bound():
    rng = np.random.default_rng(2)
    for _ in range(300):
        x = rng.uniform() ** 0.2 * on_boundary(int(rng.integers(len(SMOOTH.nominal_gains))), rng)
        assert np.all(np.abs(step(SMOOTH, x).input) <= SMOOTH.nominal_input_bound * np.sqrt(BOUNDARY))


def test_outside_the_family_it_is_the_outermost_gain_and_inside_the_last_the_innermost():
    x = 3.0 * on_boundary(0, np.random.default_rng(3))
    result = step(SMOOTH, x)
    assert (result.gain_index, result.status) == (0, NominalStatus.OUTSIDE_FAMILY)
    assert_array_equal(result.input, step(SWITCHED, x).input)
    near = 0.5 * on_boundary(len(SMOOTH.nominal_gains) - 1, np.random.default_rng(4))
    assert_array_equal(step(SMOOTH, near).input, step(SWITCHED, near).input)
    assert_array_equal(step(SMOOTH, np.zeros(9)).input, 0.0)
    assert step(SMOOTH, np.full(9, np.nan)).status == NominalStatus.OUTSIDE_FAMILY


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


@pytest.mark.long
def test_two_flights_are_bit_identical_whatever_the_pace(flight):
    slow = fly(len(flight), pause=0.01)
    for one, other in zip(flight, slow, strict=True):
        assert np.array_equal(one.input, other.input) and np.array_equal(one.gain, other.gain)


@pytest.mark.long
def test_a_failed_solve_leaves_the_family():
    law, far = KothareLaw(DESIGN, DATA), 30.0 * STEP
    results = [law.step(far) for _ in range(SOLVE_STEPS + 1)]
    failed = NominalStatus.SOLVER_FAILED | NominalStatus.FAMILY_FALLBACK
    assert results[-2].status == NominalStatus.OUTSIDE_FAMILY
    assert results[-1].status == failed | NominalStatus.OUTSIDE_FAMILY
    assert np.array_equal(results[-1].input, FamilyLaw(DATA).step(far).input)


@pytest.mark.long
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


@pytest.mark.long
def test_near_the_reference_nothing_is_solved_and_reset_returns_to_the_family():
    law = KothareLaw(DESIGN, DATA)
    for _ in range(SOLVE_STEPS + 1):
        result = law.step(STEP)
    assert result.gain_index == NOT_IN_FAMILY
    law.reset()
    near = 0.01 * STEP
    results = [law.step(near) for _ in range(SOLVE_STEPS + 1)]
    assert all(r.gain_index == len(DATA.gains) - 1 and r.status == NominalStatus.OK for r in results)
