"""Linear matrix inequalities with one answer: the point of the central path, whatever rounds on the way to it."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.control.nominal_gain import nominal_gain
from hsv.control.optimisation import GAP, Unknown, minimise
from hsv.design.baseline import initial_deviation, nominal_problem


def test_the_cost_is_above_its_optimum_by_the_gap():
    # Minimum of t x - log(x - 3): x = 3 + 1 / t.
    (x,), report = minimise([Unknown((1, 1))], lambda x: x[0, 0], lambda x: [x - 3.0], "scalar")
    assert GAP / 2.0 < x[0, 0] / 3.0 - 1.0 < 2.0 * GAP
    assert report.objective == x[0, 0]


def test_a_symmetric_matrix_is_found():
    # The least trace of Q >= C is that of C; the least eigenvalue of Q - C is that of the barrier, the same in all.
    C = np.array([[2.0, -0.5, 0.1], [-0.5, 1.0, 0.0], [0.1, 0.0, 3.0]])
    (Q,), _ = minimise([Unknown((3, 3), symmetric=True)], lambda Q: float(np.trace(Q)), lambda Q: [Q - C], "matrix")
    assert np.array_equal(Q, Q.T)
    assert_allclose(Q - C, np.eye(3) * (Q - C)[0, 0], atol=1e-9)


def test_what_has_no_solution_is_refused_by_name():
    with pytest.raises(DesignError, match="nothing: status"):
        minimise([Unknown((1, 1))], lambda x: x[0, 0], lambda x: [x - 1.0, 0.5 - x], "nothing")


def test_nominal_gain_hardly_moves_with_the_rounding_of_vertices(inputs, model):
    # The optimum itself is so flat that entries of the gain moved by 88 % between two processors.
    problem = nominal_problem(inputs, model.polytope, inputs.nominal.input_bound.array())
    state = 0.2 * initial_deviation(inputs)
    noise = np.random.default_rng(1).uniform(-1e-10, 1e-10, problem.A.shape)
    scale = problem.state_scale
    moved = dataclasses.replace(problem, A=problem.A + noise * scale[:, None] / scale)
    one, other = nominal_gain(problem, state), nominal_gain(moved, state)
    size = problem.input_scale[:, None] / scale
    assert np.abs((one.K - other.K) / size).max() < 1e-5
    diagonal = np.sqrt(np.diag(one.Q))
    assert np.abs((one.Q - other.Q) / np.outer(diagonal, diagonal)).max() < 1e-5
