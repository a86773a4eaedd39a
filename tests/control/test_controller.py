"""Custom controllers, in Python and compiled, and robust MPC: outputs are checked and limited, states are separate."""

import ctypes
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ControllerError, DesignError, ParameterError
from hsv.control.controller import (
    CONTROLLER_INPUTS,
    STEP_FUNCTION,
    ControllerInput,
    ExternalController,
    NodeController,
    StepKernel,
    flat_input,
)
from hsv.control.design_file import find_design, read_design
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeStatusCode
from hsv.model.vehicle import load_vehicle
from hsv.plugins.controllers import build_controller

VEHICLE = load_vehicle().decoupled
LOW, HIGH = VEHICLE.input_minimum, VEHICLE.input_maximum
NUMBERS = np.arange(34.0)
INPUTS = ControllerInput(
    7, *(part[0] if len(part) == 1 else part for part in np.split(NUMBERS, [9, 10, 19, 21, 30, 32]))
)


class Counting:
    """A controller that outputs the number of steps since its reset (times 0.1) and a constant elevator."""

    def __init__(self, elevator):
        self.elevator = elevator
        self.count = 0

    def reset(self):
        self.count = 0

    def step(self, inputs):
        self.count += 1
        return 0.1 * self.count, self.elevator


@STEP_FUNCTION
def counting(k, given, out, state, parameters):
    """The same counter, compiled: the elevator is the parameter times the last of the inputs."""
    count, answer = (ctypes.cast(a, ctypes.POINTER(ctypes.c_double)) for a in (state, out))
    if k < 0:
        return 3
    count[0] += 1.0
    answer[0] = 0.1 * count[0]
    answer[1] = (
        ctypes.cast(parameters, ctypes.POINTER(ctypes.c_double))[0]
        * ctypes.cast(given, ctypes.POINTER(ctypes.c_double))[33]
    )
    return 0


class Compiled:
    kernel = StepKernel(ctypes.cast(counting, ctypes.c_void_p).value, np.zeros(1), np.array([0.002]))


@pytest.mark.parametrize(("own", "elevator"), [(Counting(0.066), 0.066), (Compiled(), 0.066)])
def test_it_is_stepped_copied_and_reset(own, elevator):
    controller = ExternalController("own", own, VEHICLE)
    first = controller.step(INPUTS)
    np.testing.assert_allclose(first.input, [0.1, elevator], rtol=1e-15)
    other = controller.copied()
    assert [controller.step(INPUTS).input[0] for _ in range(3)] == pytest.approx([0.2, 0.3, 0.4])
    assert other.step(INPUTS).input[0] == pytest.approx(0.2)
    controller.reset()
    assert controller.step(INPUTS).input[0] == pytest.approx(0.1)
    assert other.step(INPUTS).input[0] == pytest.approx(0.3)


def test_what_it_wants_is_limited():
    for wanted in (-5.0, 5.0):
        result = ExternalController("own", Counting(wanted), VEHICLE).step(INPUTS)
        assert result.input[1] == (HIGH[1] if wanted > 0.0 else LOW[1])
        assert_array_equal(result.u_unsaturated, [0.1, wanted])
        assert_array_equal(result.saturated, [False, True])


class Answering:
    def __init__(self, answer):
        self.answer = answer

    def reset(self):
        self.step(None)

    def step(self, inputs):
        if isinstance(self.answer, BaseException):
            raise self.answer
        return self.answer


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ((0.1, float("nan")), r"^own, step 7: .*answered \[0\.1, nan\]"),
        ((0.1,), r"^own, step 7: .*answered \(0\.1,\)"),
        (None, r"^own, step 7: .*answered None"),
        ((0.1 + 0.0j, 0.2), r"^own, step 7: .*answered \(\(0\.1\+0j\), 0\.2\)"),
        (ValueError("two\nlines"), r"^own, step 7: ValueError: two lines \(test_controller.py:\d+\)$"),
        (SystemExit("bye"), r"^own, step 7: SystemExit: bye \(test_controller.py:\d+\)$"),
    ],
)
def test_what_is_no_answer_is_an_error_with_its_step(answer, message):
    controller = ExternalController("own", Answering(answer), VEHICLE)
    with pytest.raises(ControllerError, match=message):
        controller.step(INPUTS)
    if isinstance(answer, BaseException):
        with pytest.raises(ControllerError, match=r"^own, reset: "):
            controller.reset()


def test_a_compiled_controller_that_returns_another_code_ends_the_flight():
    controller = ExternalController("own", Compiled(), VEHICLE)
    with pytest.raises(ControllerError, match=r"^own, step -1: RunError: returned 3$"):
        controller.step(INPUTS._replace(step=-1))


def test_inputs_are_in_the_order_in_which_they_are_declared():
    flat = flat_input(INPUTS)
    assert_array_equal(flat, NUMBERS)
    assert [signal.size for signal in CONTROLLER_INPUTS[:-1]] == [9, 1, 9, 2, 9, 2]


def test_a_node_of_its_own_is_not_stepped_here():
    controller = NodeController("node")
    controller.reset()
    for use in (lambda: controller.step(INPUTS), lambda: controller.kernel):
        with pytest.raises(ParameterError, match="controller = 'node': a node of its own, expected hsv run to fly it"):
            use()


PATH = find_design("baseline")
DESIGN = read_design(PATH)
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
    law = build_controller({"controller": "robust_mpc", "robust_mpc.gain_index": 6}, DESIGN)
    assert isinstance(law, RobustMpc)
    assert np.array_equal(law.kernel.gains[0], DESIGN.nominal_gains[-1])
    with pytest.raises(ParameterError, match=r"robust_mpc.gain_index = 9: expected 0 to 6"):
        build_controller({"controller": "robust_mpc", "robust_mpc.gain_index": 9}, DESIGN)
    with pytest.raises(DesignError, match=r"controller = 'tube_mpc': no design, expected one"):
        build_controller({}, None)
    with pytest.raises(ParameterError, match=r"controller = 'lucky'"):
        build_controller({"controller": "lucky"}, DESIGN)
