import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import ParameterError
from hsv.control.controller import ControllerInput
from hsv.control.controllers import build_controller
from hsv.control.design import find_design, read_design, read_parameters
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeStatusCode

PATH = find_design("baseline")
VALUES, DESIGN = read_parameters(PATH), read_design(PATH)
X_R, U_R = np.array([26000.0, 2400.0, 0.03, 0.03, 0.0, 1.0, 0.0, 1.0, 0.0]), np.array([0.27, 0.21])
X = X_R + np.array([2.0, -1.0, 1e-3, 2e-3, 0.9, 0.0, 0.0, 0.0, 0.0])
NOTHING = np.empty(0)


@pytest.mark.parametrize("index", [0, 3, 6])
def test_law_is_one_gain_about_the_reference_with_the_filtered_rate(index):
    result = RobustMpc(DESIGN, index).step(ControllerInput(0, X, 4e-3, X_R, U_R, np.ones(9), np.ones(2), NOTHING))
    deviation = X - X_R
    deviation[4] = 4e-3
    assert_allclose(result.u_unsaturated, U_R + DESIGN.nominal_gains[index] @ deviation, rtol=1e-12)
    assert_allclose(result.error, (X - X_R)[:5])
    assert result.status is TubeStatusCode.NO_SET and not result.inside and math.isnan(result.level)


def test_input_is_limited_and_what_is_not_a_number_is_told():
    rest = 0.0, X_R, U_R, np.zeros(9), np.zeros(2), NOTHING
    result = RobustMpc(DESIGN).step(ControllerInput(0, X_R + 1e4, *rest))
    assert np.all((result.input == DESIGN.input_minimum) | (result.input == DESIGN.input_maximum))
    assert result.saturated.all()
    result = RobustMpc(DESIGN).step(ControllerInput(0, np.full(9, np.nan), *rest))
    assert result.status is TubeStatusCode.INVALID_INPUT


def test_parameters_choose_controller_and_gain():
    law = build_controller({**VALUES, "controller": "robust_mpc", "robust_mpc.gain_index": 6})
    assert isinstance(law, RobustMpc)
    assert np.array_equal(law.kernel.gains[0], DESIGN.nominal_gains[-1])
    with pytest.raises(ParameterError, match=r"robust_mpc.gain_index = 9: expected 0 to 6"):
        build_controller({**VALUES, "controller": "robust_mpc", "robust_mpc.gain_index": 9})
    with pytest.raises(ParameterError, match=r"controller = 'lucky'"):
        build_controller({**VALUES, "controller": "lucky"})
