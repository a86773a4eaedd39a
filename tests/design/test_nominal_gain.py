import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.control.design_file import find_design, read_design
from hsv.design.baseline import disturbance_columns, initial_deviation, require_margins
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import find_inputs, read_inputs
from hsv.lmi.nominal_gain import NominalProblem, nested_gains


@pytest.fixture(scope="module")
def problem(design, inputs):
    A, B = design.polytope.A[:, :5, :5], design.polytope.B[:, :5]
    n = inputs.nominal
    scales = n.state_scale.array(), n.input_scale.array(), n.input_bound.array()
    return NominalProblem(A, B, design.period, *scales)


@pytest.fixture(scope="module")
def state(inputs):
    return initial_deviation(inputs)


def test_certified_cost_is_that_of_the_study(report):
    first = report["nominal"][0]
    # Control study, section 6: a certified cost of 1060 s for the five rigid-body states.
    assert_allclose(first["certified_gamma"], 1060.0, rtol=0.02)
    for row in report["nominal"]:
        assert min(row["lmi_smallest_eigenvalues"]) >= 0.0
        assert row["state_residual"] >= 0.0 and min(row["input_residuals"]) >= 0.0


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


FOOT = 0.3048


def rigid(design):
    return design.polytope.A[:, :5, :5], design.polytope.B[:, :5]


def test_gain_agrees_with_the_control_study(design):
    # Control study, section 0, design R, computed on grid vertices; gains per foot.
    expected = [[-0.0028, -0.0144, 50.30, -54.27, -1.409], [0.0033, -0.0024, -52.89, 61.48, 3.819]]
    gain = design.feedback_gain[:, :5] * [FOOT, FOOT, 1.0, 1.0, 1.0]
    assert_allclose(gain, expected, rtol=0.04, atol=6e-5)
    assert np.all(design.feedback_gain[:, 5:] == 0.0)


def test_pure_feasibility_gives_a_certified_but_unusable_gain(design, inputs):
    A, B = rigid(design)
    columns = disturbance_columns(inputs)
    scales = inputs.feedback.state_scale.array(), inputs.feedback.input_scale.array()
    literal = feedback_gain(A, B, columns, *scales, method="feasibility")
    assert literal.residuals.min() > 0.0
    assert np.abs(literal.F[:, 2]).max() > 1000.0
    assert literal.F[1, 4] > 20.0


def test_the_gain_comes_out_as_shipped(design, inputs):
    A, B = rigid(design)
    columns = disturbance_columns(inputs)
    again = feedback_gain(A, B, columns, inputs.feedback.state_scale.array(), inputs.feedback.input_scale.array())
    assert_allclose(again.F, design.feedback_gain[:, :5], rtol=1e-6)


def test_a_design_below_the_required_margin_is_refused_with_loop_and_vertex():
    inputs = read_inputs(find_inputs("robust"))
    require_margins(inputs, read_design(find_design("robust")))
    with pytest.raises(
        DesignError, match=r"^margins\.elevator = 0\.8\d*: the loop has a disk margin of 0\.6\d\d at vertex"
    ):
        require_margins(inputs, read_design(find_design("baseline")))
