"""The nested family, switched and interpolated between its ellipsoids."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.control.design import find_design, read_design
from hsv.control.nominal_law import MEMBERSHIP_TOLERANCE, FamilyLaw, NominalStatus
from hsv.control.nominal_trajectory import nominal_data

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
