"""The nominal laws: the nested family of gains, and the LMI that is solved in flight."""

import dataclasses

import numpy as np
import pytest

from hsv.control.design_file import find_design, read_design
from hsv.control.nominal_law import (
    NOT_IN_FAMILY,
    SOLVE_STEPS,
    FamilyLaw,
    KothareLaw,
    NominalStatus,
)
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_data
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.core import lib
from hsv.lmi.nominal_gain import NominalProblem, nominal_gain
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

SMOOTH = read_design(find_design("smooth"))
SWITCHED = dataclasses.replace(SMOOTH, interpolated=False)
BOUNDARY = lib.MEMBERSHIP_BOUNDARY


def on_boundary(index, rng):
    """Return a random state on the boundary of a nominal ellipsoid, with the elastic states at rest."""
    direction = rng.normal(size=5)
    root = np.linalg.cholesky(np.linalg.inv(SMOOTH.nominal_ellipsoids[index]))
    return np.append(root @ (direction / np.linalg.norm(direction)), np.zeros(4)) * np.sqrt(BOUNDARY)


def step(design, x):
    return FamilyLaw(nominal_data(design)).step(x)


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


DESIGN = read_design(find_design("baseline"))
DATA = nominal_data(DESIGN)
START, REFERENCE = trim(load_vehicle().coupled(), 26060.4, 2407.92), trim(load_vehicle().coupled(), 26243.28, 2484.12)
TRAJECTORY = ReferenceTrajectory([0.0], [26243.28], [2484.12], DESIGN.period, load_vehicle().decoupled)
STEP = START.state - REFERENCE.state


@pytest.fixture(scope="module")
def flight():
    """Return the results of a nominal flight: every measurement is the nominal state."""
    trajectory = NominalTrajectory(DESIGN, TRAJECTORY, KothareLaw(DESIGN, DATA))
    results, measured = [], START.state
    for _ in range(2 * SOLVE_STEPS + 1):
        results.append(trajectory.step(measured))
        measured = results[-1].reference + results[-1].deviation
    return results


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
def test_a_failed_solve_leaves_the_family():
    law, far = KothareLaw(DESIGN, DATA), 30.0 * STEP
    results = [law.step(far) for _ in range(SOLVE_STEPS + 1)]
    failed = NominalStatus.SOLVER_FAILED | NominalStatus.FAMILY_FALLBACK
    assert results[-2].status == NominalStatus.OUTSIDE_FAMILY
    assert results[-1].status == failed | NominalStatus.OUTSIDE_FAMILY
    assert np.array_equal(results[-1].input, FamilyLaw(DATA).step(far).input)
