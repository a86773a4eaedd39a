import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.control.controller import ControllerInput
from hsv.control.design_file import find_design, read_design
from hsv.control.notch_filter import NotchFilter
from hsv.control.tube_law import TubeLaw, TubeStatusCode
from hsv.model.vehicle import load_vehicle

LIMITS = load_vehicle().decoupled

DESIGN = read_design(find_design("baseline"))
REFERENCE = np.array([26243.28, 2484.12, 0.028, 0.028, 0.0, 0.98, 0.0, 0.8, 0.0])
REFERENCE_INPUT = np.array([0.27, 0.21])
FILTER_STATE = np.zeros(2)
ZERO = np.zeros(9)


def step(law, state=REFERENCE, rate=0.0, deviation=ZERO, nominal_input=ZERO[:2], k=0):
    return law.step(ControllerInput(k, state, rate, REFERENCE, REFERENCE_INPUT, deviation, nominal_input, FILTER_STATE))


def near(rng):
    return rng.normal(size=9) * [5.0, 2.0, 0.002, 0.002, 0.005, 0.2, 2.0, 0.2, 2.0]


@pytest.mark.parametrize("tau", [1.0, 0.8])
def test_law_is_equation_36(tau):
    rng = np.random.default_rng(1)
    for _ in range(50):
        state, deviation, u_n, rate = REFERENCE + near(rng), near(rng), rng.normal(size=2) * 0.02, rng.normal() * 0.01
        result = step(TubeLaw(dataclasses.replace(DESIGN, tau=np.full(5, tau))), state, rate, deviation, u_n)
        measured = state.copy()
        measured[4] = rate
        feedback = tau * DESIGN.feedback_gain @ (measured - REFERENCE - deviation)
        assert_allclose(result.u_feedback, feedback, rtol=1e-9, atol=1e-12)
        assert_allclose(result.u_unsaturated, feedback + u_n + REFERENCE_INPUT, rtol=1e-9)
        assert_array_equal(result.input, np.clip(result.u_unsaturated, LIMITS.input_minimum, LIMITS.input_maximum))
        assert result.tau.tolist() == [tau]


def test_feedback_uses_the_filtered_rate_but_the_error_the_true_one():
    state = REFERENCE.copy()
    state[4] = 0.02
    result = step(TubeLaw(DESIGN), state, rate=0.0)
    assert_allclose(result.u_feedback, 0.0, atol=1e-12)
    assert result.error[4] == 0.02


@pytest.mark.parametrize("component", range(9))
@pytest.mark.parametrize("value", [1e9, -1e9, 1111.1])
def test_absurd_states_stay_within_the_limits_and_are_marked(component, value):
    state = REFERENCE.copy()
    state[component] = value
    result = step(TubeLaw(DESIGN), state, rate=state[4])
    assert np.all((result.input >= LIMITS.input_minimum) & (result.input <= LIMITS.input_maximum))
    assert_array_equal(result.saturated, result.input != result.u_unsaturated)
    assert np.any(result.saturated) == (component < 5)


SIGNALS = {"state": 9, "rate": 1, "deviation": 9, "nominal_input": 2}


@pytest.mark.parametrize("planned_by_filter", [False, True])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.7e308, -1.7e308])
@pytest.mark.parametrize(("signal", "component"), [(s, c) for s, size in SIGNALS.items() for c in range(size)])
def test_actuators_get_a_number_whatever_is_measured_or_planned(signal, component, value, planned_by_filter):
    law = TubeLaw(dataclasses.replace(DESIGN, filtered=planned_by_filter))
    given = {name: np.zeros(size) for name, size in SIGNALS.items()}
    given["state"] = REFERENCE.copy()
    given[signal][component] = value
    given["rate"] = float(given["rate"][0])
    result = step(law, **given)
    assert np.all((result.input >= LIMITS.input_minimum) & (result.input <= LIMITS.input_maximum))
    lost = ~np.isfinite(result.u_unsaturated)
    assert_array_equal(result.input[lost], REFERENCE_INPUT[lost])
    assert (result.status is TubeStatusCode.INVALID_INPUT) == lost.any()
    if math.isnan(value) and signal in ("state", "rate") and component != 4:
        assert lost.all()
        assert not result.inside


def test_nothing_of_a_state_that_is_no_number_is_left_in_the_next_step():
    error = np.array([0.5, -0.2, *np.zeros(7)])
    integrating = TubeLaw(DESIGN, integral_rate=0.1)
    results = []
    for between in (math.nan, math.inf):
        integrating.reset()
        step(integrating, REFERENCE + error)
        assert step(integrating, np.full(9, between), k=1).status is TubeStatusCode.INVALID_INPUT
        results.append(step(integrating, REFERENCE, k=2).u_feedback)
    expected = 0.1 * DESIGN.period * DESIGN.feedback_gain[:, :2] @ error[:2]
    assert_allclose(results, [expected, expected], rtol=1e-9)


def adjustable(minimum=0.5, tau=1.0, **changes):
    factors = {"tau": np.full(5, tau), "tau_minimum": np.broadcast_to(minimum, 5)}
    return dataclasses.replace(DESIGN, **factors, **changes)


def test_a_change_of_tau_acts_from_the_next_step_on_and_outlives_the_run():
    law, state = TubeLaw(adjustable([0.5, 0.5, 0.75, 0.75, 1.0])), REFERENCE + near(np.random.default_rng(3))
    before = [step(law, state, k=k).u_feedback for k in range(3)]
    assert law.change_tau([0.8, 0.8, 0.9, 0.9, 1.0]) == 3
    after = [step(law, state, k=k) for k in (3, 4)]
    assert_array_equal(before, np.tile(before[0], (3, 1)))
    assert [result.tau.tolist() for result in after] == [[0.8, 0.8, 0.9, 0.9, 1.0]] * 2
    lost = DESIGN.feedback_gain[:, :5] @ ([0.2, 0.2, 0.1, 0.1, 0.0] * (state - REFERENCE)[:5])
    assert_allclose(after[0].u_feedback, before[0] - lost, rtol=1e-9)
    assert law.change_tau([1.0]) == 5
    assert [(start, tau[0]) for start, tau in law.factors] == [(0, 1.0), (3, 0.8), (5, 1.0)]
    assert_array_equal(step(law, state, k=5).u_feedback, before[0])
    law.change_tau([0.5, 0.5, 0.75, 0.75, 1.0])
    law.reset()
    assert step(law, state).tau.tolist() == [0.5, 0.5, 0.75, 0.75, 1.0]


def test_a_factor_that_is_not_certified_is_refused_and_changes_nothing():
    law = TubeLaw(adjustable())
    with pytest.raises(ParameterError, match=r"feedback\.tau = 0.4: expected 0.5 to 1, the certified range"):
        law.change_tau([0.4])
    assert step(law).tau.tolist() == [1.0]


def test_scheduled_changes_come_at_their_times():
    values = {"tau_change.starts": [0.04, 0.1], "tau_change.values": [0.8, 0.6]}
    law = TubeLaw.from_parameters(values, adjustable())
    assert [step(law, k=k).tau[0] for k in range(7)] == [1.0, 1.0, 0.8, 0.8, 0.8, 0.6, 0.6]
    each = [0.8, 0.8, 0.8, 0.8, 0.8, 0.6, 0.6, 0.6, 0.6, 0.6]
    in_full = TubeLaw.from_parameters(values | {"tau_change.values": each}, adjustable())
    assert in_full.kernel.gains.tolist() == law.kernel.gains.tolist()
    law.reset()
    assert law.change_tau([0.9]) == 0
    assert [step(law, k=k).tau[0] for k in range(3)] == [0.9, 0.9, 0.8]


def test_filtered_feedback_is_blind_to_what_the_filter_does_to_the_plan():
    rates = 0.02 * np.sin(np.arange(60))
    inputs = {}
    for filtered in (False, True):
        law, notch = TubeLaw(adjustable(filtered=filtered)), NotchFilter(DESIGN.notch, DESIGN.period)
        inputs[filtered] = []
        for k, rate in enumerate(rates):
            x, x_n = REFERENCE.copy(), np.zeros(9)
            x[4] = x_n[4] = rate
            measured = notch.step(rate)
            q_f, s = measured.filtered_pitch_rate, measured.filter_state
            result = law.step(ControllerInput(k, x, q_f, REFERENCE, REFERENCE_INPUT, x_n, np.zeros(2), s))
            inputs[filtered].append(result.u_feedback)
    assert np.abs(inputs[True]).max() < 1e-12 < 1e-4 < np.abs(inputs[False]).max()


ERROR = np.array([0.5, -0.2, *np.zeros(7)])


def test_the_integral_acts_on_altitude_and_velocity_error_and_is_emptied_by_a_reset():
    plain, law = TubeLaw(DESIGN), TubeLaw(DESIGN, integral_rate=0.1)
    assert_allclose(
        step(law, REFERENCE + ERROR).u_unsaturated, step(plain, REFERENCE + ERROR).u_unsaturated, rtol=1e-15
    )
    for k in range(1, 50):
        step(law, REFERENCE + ERROR, k=k)
    expected = 0.1 * DESIGN.feedback_gain[:, :2] @ ERROR[:2] * 50 * 0.02
    assert_allclose(step(law, REFERENCE, k=50).u_feedback, expected, rtol=1e-9)
    law.reset()
    assert_array_equal(step(law, REFERENCE).u_feedback, 0.0)


def test_the_integral_stands_still_while_an_input_is_limited():
    law = TubeLaw(DESIGN, integral_rate=0.1)
    for k in range(100):
        assert step(law, REFERENCE - np.array([1e5, *np.zeros(8)]), k=k).saturated.any()
    assert_array_equal(step(law, REFERENCE, k=100).u_feedback, 0.0)
