import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solve_discrete_are

from hsv.base.errors import DesignError
from hsv.control.optimisation import lqr_whitening


def test_riccati_solution_becomes_the_identity(design):
    A, B = design.polytope.A[:, :5, :5], design.polytope.B[:, :5]
    state, inputs = np.array([6.0, 3.0, 0.05, 0.05, 0.2]), np.array([0.15, 0.07])
    white = lqr_whitening(A, B, state, inputs)
    A_white, B_white = white.dynamics(A.mean(axis=0), B.mean(axis=0))
    root = white.from_white / state[:, None]
    assert_allclose(solve_discrete_are(A_white, B_white, root.T @ root, np.eye(2)), np.eye(5), atol=1e-6)


def test_gain_goes_back_to_the_same_closed_loop(design):
    A, B = design.polytope.A[0, :5, :5], design.polytope.B[0, :5]
    white = lqr_whitening(A[None], B[None], np.ones(5), np.array([0.3, 0.1]))
    A_white, B_white = white.dynamics(A, B)
    K = np.arange(10.0).reshape(2, 5)
    back = white.from_white @ (A_white + B_white @ K) @ white.to_white
    assert_allclose(back, A + B @ white.gain(K), rtol=1e-9, atol=1e-9)


def test_uncontrollable_model_is_refused():
    with pytest.raises(DesignError, match="no stabilising LQR solution"):
        lqr_whitening(np.array([[[1.1]]]), np.array([[[0.0]]]), np.ones(1), np.ones(1))
