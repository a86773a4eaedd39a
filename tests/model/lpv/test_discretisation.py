import numpy as np
from numpy.testing import assert_allclose

from hsv.model.lpv.linearisation import zero_order_hold


def test_double_integrator_is_exact():
    A, B = zero_order_hold(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.02)
    assert_allclose(A, [[1.0, 0.02], [0.0, 1.0]], rtol=1e-15)
    assert_allclose(B, [[0.5 * 0.02**2], [0.02]], rtol=1e-15)


def test_two_half_periods_make_one():
    rng = np.random.default_rng(1)
    A, B = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    whole_A, whole_B = zero_order_hold(A, B, 0.1)
    half_A, half_B = zero_order_hold(A, B, 0.05)
    assert_allclose(half_A @ half_A, whole_A, rtol=1e-12)
    assert_allclose(half_A @ half_B + half_B, whole_B, rtol=1e-12)
