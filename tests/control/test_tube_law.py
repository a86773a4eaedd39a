import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.control.design_file import find_design, read_design
from hsv.control.tube_law import TubeLaw, TubeStatusCode
from hsv.vehicle.envelope import INPUT_MAXIMUM, INPUT_MINIMUM

DESIGN = read_design(find_design("baseline"))
REFERENCE = np.array([26243.28, 2484.12, 0.028, 0.028, 0.0, 0.98, 0.0, 0.8, 0.0])
REFERENCE_INPUT = np.array([0.27, 0.21])
FILTER_STATE = np.zeros(2)
ZERO = np.zeros(9)


def step(law, state=REFERENCE, rate=0.0, deviation=ZERO, nominal_input=ZERO[:2]):
    return law.step(state, rate, FILTER_STATE, REFERENCE, REFERENCE_INPUT, deviation, nominal_input)


def near(rng):
    return rng.normal(size=9) * [5.0, 2.0, 0.002, 0.002, 0.005, 0.2, 2.0, 0.2, 2.0]


def test_on_the_nominal_trajectory_it_plays_reference_plus_nominal_input():
    deviation = near(np.random.default_rng(0))
    u_n = np.array([0.05, 0.01])
    result = step(TubeLaw(DESIGN), REFERENCE + deviation, deviation[4], deviation, u_n)
    assert_allclose(result.input, REFERENCE_INPUT + u_n, rtol=1e-9)
    assert_allclose(result.u_feedback, 0.0, atol=1e-9)


@pytest.mark.parametrize("tau", [1.0, 0.8])
def test_law_is_equation_36(tau):
    rng = np.random.default_rng(1)
    for _ in range(50):
        state, deviation, u_n, rate = REFERENCE + near(rng), near(rng), rng.normal(size=2) * 0.02, rng.normal() * 0.01
        result = step(TubeLaw(DESIGN, tau), state, rate, deviation, u_n)
        measured = state.copy()
        measured[4] = rate
        feedback = tau * DESIGN.feedback_gain @ (measured - REFERENCE - deviation)
        assert_allclose(result.u_feedback, feedback, rtol=1e-9, atol=1e-12)
        assert_allclose(result.u_unsaturated, feedback + u_n + REFERENCE_INPUT, rtol=1e-9)
        assert_array_equal(result.input, np.clip(result.u_unsaturated, INPUT_MINIMUM, INPUT_MAXIMUM))
        assert result.tau == tau


def test_flexible_states_are_not_fed_back():
    assert_array_equal(DESIGN.feedback_gain[:, 5:], 0.0)
    shaken = REFERENCE.copy()
    shaken[5:] += 100.0
    assert_array_equal(step(TubeLaw(DESIGN), shaken).input, step(TubeLaw(DESIGN)).input)


def test_feedback_uses_the_filtered_rate_but_the_error_the_true_one():
    state = REFERENCE.copy()
    state[4] = 0.02
    result = step(TubeLaw(DESIGN), state, rate=0.0)
    assert_allclose(result.u_feedback, 0.0, atol=1e-12)
    assert result.error[4] == 0.02


@pytest.mark.parametrize("component", range(9))
@pytest.mark.parametrize("value", [1e9, -1e9, 1111.1, math.inf, -math.inf])
def test_absurd_states_stay_within_the_limits_and_are_told(component, value):
    state = REFERENCE.copy()
    state[component] = value
    result = step(TubeLaw(DESIGN), state, rate=state[4])
    finite = np.isfinite(result.u_unsaturated)
    assert np.all((result.input >= INPUT_MINIMUM) & (result.input <= INPUT_MAXIMUM) | ~finite)
    assert_array_equal(result.saturated, result.input != result.u_unsaturated)
    if component < 4 and math.isfinite(value):
        assert np.any(result.saturated)
    if not np.all(finite):
        assert result.status is TubeStatusCode.INVALID_INPUT


@pytest.mark.parametrize("component", range(9))
def test_a_state_that_is_no_number_is_told(component):
    state = REFERENCE.copy()
    state[component] = math.nan
    result = step(TubeLaw(DESIGN), state, rate=state[4])
    assert result.status is TubeStatusCode.INVALID_INPUT
    assert not (result.inside and component < 5)


def test_absurd_nominal_inputs_are_limited():
    result = step(TubeLaw(DESIGN), nominal_input=np.array([1e9, -1e9]))
    assert_array_equal(result.input, [INPUT_MAXIMUM[0], INPUT_MINIMUM[1]])
    assert_array_equal(result.saturated, [True, True])


def test_law_itself_has_no_memory():
    rng = np.random.default_rng(4)
    law = TubeLaw(DESIGN)
    state = REFERENCE + near(rng)
    first = step(law, state, 0.001)
    step(law, REFERENCE + near(rng), 0.1)
    again = step(law, state, 0.001)
    assert_array_equal(again.input, first.input)
    assert_array_equal(again.u_unsaturated, first.u_unsaturated)
