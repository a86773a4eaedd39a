import numpy as np
from numpy.testing import assert_allclose

from hsv.design.baseline import disturbance_columns
from hsv.design.feedback import feedback_gain

FOOT = 0.3048


def rigid(design):
    return design.polytope.A[:, :5, :5], design.polytope.B[:, :5]


def test_gain_agrees_with_the_control_study(design):
    # Control study, section 0, design R, found on grid vertices; per foot.
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
