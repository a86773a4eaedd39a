import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from hsv.control.controller import ControllerInput
from hsv.control.design import find_design, read_design, read_parameters
from hsv.control.tube_law import TubeLaw

PATH = find_design("baseline")
VALUES, DESIGN = read_parameters(PATH), read_design(PATH)
X_R, U_R = np.array([26000.0, 2400.0, 0.03, 0.03, 0.0, 1.0, 0.0, 1.0, 0.0]), np.array([0.27, 0.21])
ERROR = np.array([0.5, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def step(law, error, k=0):
    x = X_R + error
    return law.step(ControllerInput(k, x, float(x[4]), X_R, U_R, np.zeros(9), np.zeros(2), np.empty(0)))


def test_acts_on_the_integral_of_altitude_and_velocity_error():
    plain, law = TubeLaw.from_parameters(VALUES), TubeLaw.from_parameters({**VALUES, "integral.rate": 0.1})
    assert_allclose(step(law, ERROR).u_unsaturated, step(plain, ERROR).u_unsaturated, rtol=1e-15)
    for k in range(1, 50):
        step(law, ERROR, k)
        assert_array_equal(step(plain, np.zeros(9), k).u_feedback, 0.0)
    result = step(law, np.zeros(9), 50)
    expected = 0.1 * DESIGN.feedback_gain[:, :2] @ ERROR[:2] * 50 * 0.02
    assert_allclose(result.u_feedback, expected, rtol=1e-9)
    assert_allclose(result.input, U_R + expected, rtol=1e-12)


def test_stands_still_while_an_input_is_limited():
    law = TubeLaw.from_parameters({**VALUES, "integral.rate": 0.1})
    far = np.array([-1e5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for k in range(100):
        assert step(law, far, k).saturated.any()
    assert_array_equal(step(law, np.zeros(9), 100).u_feedback, 0.0)


def test_reset_empties_the_integral():
    law = TubeLaw.from_parameters({**VALUES, "integral.rate": 0.1})
    step(law, ERROR)
    law.reset()
    assert_array_equal(step(law, np.zeros(9)).u_feedback, 0.0)
