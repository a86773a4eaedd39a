import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.control.design import find_design, read_design
from hsv.control.nominal_gain import NominalProblem, certified_cost, nested_gains
from hsv.design.baseline import initial_deviation


@pytest.fixture(scope="module")
def problem(design, inputs):
    A, B = design.polytope.A[:, :5, :5], design.polytope.B[:, :5]
    n = inputs.nominal
    scales = n.state_scale.array(), n.input_scale.array(), n.input_bound.array()
    return NominalProblem(A, B, design.period, *scales)


@pytest.fixture(scope="module")
def state(inputs):
    return initial_deviation(inputs)


def test_certified_cost_is_a_bound_close_to_the_solver_s(report):
    first = report["nominal"][0]
    # Control study, section 6: 1060 s certified for the five rigid states.
    assert_allclose(first["certified_gamma"], 1060.0, rtol=0.02)
    for row in report["nominal"]:
        assert_allclose(row["certified_gamma"], row["gamma"], rtol=5e-3)
        assert min(row["lmi_smallest_eigenvalues"]) >= 0.0
        assert row["state_residual"] >= 0.0 and min(row["input_residuals"]) >= 0.0


def test_certified_cost_is_tight(design, problem, report):
    Q, K = np.array(report["nominal"][0]["Q"]), design.nominal_gains[0, :, :5]
    gamma, _ = certified_cost(problem, K, Q, "K")
    P = gamma * np.linalg.inv(Q)
    weight = np.diag(1.0 / problem.state_scale**2) + K.T @ np.diag(1.0 / problem.input_scale**2) @ K
    closed = problem.A + problem.B @ K
    scale = np.linalg.inv(np.linalg.cholesky(weight))

    def margin(bound):
        drop = bound * (P - np.swapaxes(closed, 1, 2) @ P @ closed) - problem.period * weight
        return np.linalg.eigvalsh(scale @ drop @ scale.T).min() / problem.period

    assert margin(1.0) > -1e-6
    assert margin(1.0 - 1e-3) < -1e-4


@pytest.mark.parametrize("scales", [[], [0.5, 0.6]])
def test_scales_must_decrease(problem, state, scales):
    with pytest.raises(DesignError, match=r"nominal\.scales"):
        nested_gains(problem, state, scales)


def test_gains_between_two_of_an_interpolated_family_shrink_the_outer_ellipsoid_and_keep_the_input_bounds(problem):
    family = read_design(find_design("smooth"))
    rng = np.random.default_rng(6)
    for i, outside in enumerate(np.linalg.inv(family.nominal_ellipsoids[:-1])):
        inner, outer = family.nominal_gains[[i + 1, i], :, :5]
        factor = np.linalg.cholesky(outside)
        for share in rng.uniform(size=4):
            K = share * outer + (1.0 - share) * inner
            P = share * family.nominal_ellipsoids[i] + (1.0 - share) * family.nominal_ellipsoids[i + 1]
            for A, B in zip(problem.A, problem.B, strict=True):
                assert np.linalg.norm(np.linalg.solve(factor, (A + B @ K) @ factor), 2) < 1.0
            assert np.all(np.sqrt(np.einsum("ij,jk,ik->i", K, np.linalg.inv(P), K)) <= problem.input_bound)
