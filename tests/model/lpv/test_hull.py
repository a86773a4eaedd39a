import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

from hsv.base.errors import DesignError
from hsv.model.lpv.tensor_product import hull_weights, relaxed, smallest_weight

BREAKPOINTS = np.linspace(-1.0, 3.0, 21)
POWERS = np.stack([BREAKPOINTS**k for k in range(1, 5)], axis=1)


@pytest.mark.parametrize("r", [2, 3, 4, 5])
def test_weights_are_non_negative_and_sum_to_one_between_breakpoints_too(r):
    weights = hull_weights(BREAKPOINTS, POWERS[:, : r - 1])
    between = CubicSpline(BREAKPOINTS, weights)(np.linspace(-1.0, 3.0, 50_001))
    assert between.min() >= -1e-12
    assert_allclose(between.sum(axis=1), 1.0, atol=1e-12)
    # Close to normal: the curve comes near every vertex.
    assert weights.max(axis=0).min() > 0.6


def test_two_vertices_are_the_ends_of_the_curve():
    weights = hull_weights(BREAKPOINTS, np.exp(BREAKPOINTS)[:, None])
    assert_allclose(weights[[0, -1]], np.eye(2)[:: 1 if weights[0, 0] > 0.5 else -1], atol=1e-9)


def test_weights_span_the_functions():
    weights = hull_weights(BREAKPOINTS, POWERS[:, :3])
    vertices = np.linalg.lstsq(weights, POWERS[:, :3], rcond=None)[0]
    assert_allclose(weights @ vertices, POWERS[:, :3], atol=1e-9)


def test_the_simplex_is_tight():
    # A weight that stays clear of zero would leave room for a smaller simplex.
    weights = hull_weights(BREAKPOINTS, POWERS[:, :2])
    assert weights.min(axis=0).max() < 1e-3
    assert abs(smallest_weight(BREAKPOINTS, weights)) < 1e-12


def test_vertices_come_in_the_order_of_their_peaks_and_always_the_same():
    weights = hull_weights(BREAKPOINTS, POWERS)
    assert np.all(np.diff(weights.argmax(axis=0)) > 0)
    assert np.array_equal(weights, hull_weights(BREAKPOINTS, POWERS))


def test_no_functions_make_one_vertex():
    assert np.array_equal(hull_weights(BREAKPOINTS, np.empty((21, 0))), np.ones((21, 1)))


def test_smallest_weight_sees_between_breakpoints():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    dip = CubicSpline(x, [1.0, 0.0, 0.0, 1.0, 5.0])
    weights = np.stack((dip(x), 1.0 - dip(x)), axis=1)
    assert_allclose(smallest_weight(x, weights), min(dip(np.linspace(0, 4, 100_001)).min(), -4.0), rtol=1e-6)
    assert_allclose(smallest_weight(x, dip(x)[:, None]), dip(np.linspace(0, 4, 100_001)).min(), rtol=1e-6)


def test_relaxed_lifts_the_least_weight_to_zero_and_keeps_the_sum():
    weights = np.array([[-0.1, 0.6, 0.5], [0.2, 0.3, 0.5]])
    lifted = relaxed(weights, -0.1)
    assert_allclose(lifted.min(), 0.0, atol=1e-16)
    assert_allclose(lifted.sum(axis=1), 1.0)
    assert np.array_equal(relaxed(lifted, 0.05), lifted)


def test_dependent_functions_are_refused():
    with pytest.raises(DesignError, match="dependent"):
        hull_weights(BREAKPOINTS, np.stack((BREAKPOINTS, 2.0 * BREAKPOINTS - 1.0), axis=1))
