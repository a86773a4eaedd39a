"""The tensor-product model and its convex hull."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

from hsv.base.errors import DesignError
from hsv.model.lpv.polytope import axis_weights, evaluate
from hsv.model.lpv.tensor_product import hull_weights, smallest_weight, tensor_product

ALTITUDES = np.linspace(100.0, 300.0, 17)
VELOCITIES = np.linspace(10.0, 20.0, 13)


def model(h, v, n=3):
    """A function of rank 3 in altitude (1, h, h^2) and rank 2 in velocity (1, 1/v), with n states."""
    rng = np.random.default_rng(7)
    c = rng.normal(size=(4, n, n + 2)) * 0.01
    a, b = h / 200.0 - 1.0, 10.0 / v
    S = c[0] + c[1] * a + c[2] * a * a * b + c[3] * b
    return np.eye(n) + S[:, :n], S[:, n:]


def samples(n=3):
    pairs = [[model(h, v, n) for v in VELOCITIES] for h in ALTITUDES]
    return np.array([[p[0] for p in row] for row in pairs]), np.array([[p[1] for p in row] for row in pairs])


@pytest.mark.parametrize("n", [3, 11])
def test_ranks_and_exactness(n):
    polytope, (altitude, velocity), _ = tensor_product(
        *samples(n), ALTITUDES, VELOCITIES, np.ones(n), np.ones(2), 1e-10
    )
    assert altitude[1].shape[1] == 3
    assert velocity[1].shape[1] == 2
    assert polytope.A.shape == (6, n, n)
    for h, v in ((117.3, 10.4), (250.1, 19.7), (300.0, 10.0)):
        A, B = polytope.at(h, v)
        expected_A, expected_B = model(h, v, n)
        assert_allclose(A, expected_A, atol=2e-6)  # error of interpolating 1 / v between 13 samples
        assert_allclose(B, expected_B, atol=2e-6)


def test_structural_zeros_stay_zero():
    A, B = samples()
    A[:, :, 0, 2] = 0.0
    B[:, :, 1, 0] = 0.0
    polytope, _, _ = tensor_product(A, B, ALTITUDES, VELOCITIES, np.ones(3), np.ones(2), 1e-10)
    assert np.all(polytope.A[:, 0, 2] == 0.0) and np.all(polytope.B[:, 1, 0] == 0.0)


def test_too_few_samples_are_refused():
    A, B = samples()
    rng = np.random.default_rng(1)
    with pytest.raises(DesignError, match="17 samples of rank 17"):
        tensor_product(A + rng.normal(size=A.shape), B, ALTITUDES, VELOCITIES, np.ones(3), np.ones(2), 1e-10)


def test_polynomial_functions_are_exact_where_the_model_is_a_polynomial():
    def at(h, v):
        return model(h, 1.0 / (v / 100.0))  # b = 10 / v, so linear in the argument

    pairs = [[at(h, v) for v in VELOCITIES] for h in ALTITUDES]
    A, B = np.array([[p[0] for p in row] for row in pairs]), np.array([[p[1] for p in row] for row in pairs])
    polytope, sampled, _ = tensor_product(A, B, ALTITUDES, VELOCITIES, np.ones(3), np.ones(2), 1e-10, "polynomial")
    assert len(polytope.A) == 6
    assert_allclose(polytope.at(131.7, 17.3)[0], at(131.7, 17.3)[0], atol=1e-12)
    for _, weights in sampled:
        assert weights.min() >= 0.0
        assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    with pytest.raises(DesignError, match=r"tensor_product\.functions = 'splines': expected one of"):
        tensor_product(A, B, ALTITUDES, VELOCITIES, np.ones(3), np.ones(2), 1e-10, "splines")


BREAKPOINTS = np.linspace(-1.0, 3.0, 21)
POWERS = np.stack([BREAKPOINTS**k for k in range(1, 5)], axis=1)


@pytest.mark.parametrize("r", [1, 2, 3, 4, 5])
def test_weights_are_non_negative_and_sum_to_one_between_breakpoints_too(r):
    weights = hull_weights(BREAKPOINTS, POWERS[:, : r - 1])
    between = CubicSpline(BREAKPOINTS, weights)(np.linspace(-1.0, 3.0, 50_001))
    assert between.min() >= -1e-12
    assert_allclose(between.sum(axis=1), 1.0, atol=1e-12)
    # Close to normal: the weights come near every vertex.
    assert weights.max(axis=0).min() > 0.6


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_weights_are_interpolated_by_splines_that_are_exact_for_polynomials(count):
    """The spline is a line through two points, a parabola through three, and cubic through more."""
    breakpoints, between = np.linspace(-1.0, 3.0, count), np.linspace(-1.0, 3.0, 31)
    powers = np.arange(min(count, 4))
    weights = axis_weights(breakpoints, breakpoints[:, None] ** powers, "cubic")
    assert_allclose(evaluate(weights, between), between[:, None] ** powers, rtol=0.0, atol=1e-12)


def test_smallest_weight_sees_between_breakpoints():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    dip = CubicSpline(x, [1.0, 0.0, 0.0, 1.0, 5.0])
    weights = np.stack((dip(x), 1.0 - dip(x)), axis=1)
    assert_allclose(smallest_weight(x, weights), min(dip(np.linspace(0, 4, 100_001)).min(), -4.0), rtol=1e-6)
    assert_allclose(smallest_weight(x, dip(x)[:, None]), dip(np.linspace(0, 4, 100_001)).min(), rtol=1e-6)


def test_dependent_functions_are_refused():
    with pytest.raises(DesignError, match="dependent"):
        hull_weights(BREAKPOINTS, np.stack((BREAKPOINTS, 2.0 * BREAKPOINTS - 1.0), axis=1))
