"""The extended states coupling model: the vehicle's own equations seen through its notch filter."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import Filter, extended_derivative, extended_jacobian, extended_state, from_true_rate
from hsv.model.signals import N_STATES
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

NOTCH = Filter(*series(continuous([NotchSection(15.0, 0.02, 15.0, 0.5)])))
TWO = Filter(*series(continuous([NotchSection(15.0, 0.02, 15.0, 0.5), NotchSection(19.0, 0.1, 25.0, 0.7)])))


@pytest.fixture(scope="module")
def point():
    return trim(load_vehicle().coupled("paper_like"), 26000.0, 2400.0)


@pytest.mark.parametrize("notch", [NOTCH, TWO])
def test_equilibrium_of_the_vehicle_is_one_of_the_ecm(point, notch):
    state = extended_state(point.state, notch)
    for printed in (False, True):
        rates = extended_derivative(state, point.input, load_vehicle().coupled("paper_like"), notch, printed)
        assert np.abs(rates).max() < 1e-10


@pytest.mark.parametrize("notch", [NOTCH, TWO])
def test_physical_reading_is_vehicle_and_filter_in_other_coordinates(point, notch):
    vehicle = load_vehicle().coupled("paper_like")
    A, B = extended_jacobian(extended_state(point.state, notch), point.input, vehicle, notch, False)
    T = from_true_rate(notch)
    joined, inputs = np.linalg.solve(T, A @ T), np.linalg.solve(T, B)
    A_vehicle, B_vehicle = jacobian(point.state, point.input, vehicle)
    assert_allclose(joined[:N_STATES, :N_STATES], A_vehicle, rtol=1e-9, atol=1e-9)
    assert_allclose(joined[:N_STATES, N_STATES:], 0.0, atol=1e-9)
    assert_allclose(inputs[:N_STATES], B_vehicle, rtol=1e-12, atol=1e-9)
    assert_allclose(joined[N_STATES:, N_STATES:], notch.A, atol=1e-9)
    assert_allclose(joined[N_STATES:, 4], notch.B, atol=1e-12)


def test_printed_reading_differs_in_the_kinematics_alone(point):
    vehicle = load_vehicle().coupled("paper_like")
    state = extended_state(point.state, NOTCH)
    physical, _ = extended_jacobian(state, point.input, vehicle, NOTCH, False)
    printed, _ = extended_jacobian(state, point.input, vehicle, NOTCH, True)
    assert set(np.nonzero(np.abs(printed - physical) > 1e-12)[0]) == {2, 3}
    assert printed[3, 4] == 1.0
    assert_allclose(printed[3, N_STATES:], 0.0, atol=1e-30)
    assert_allclose(physical[3, 4] * NOTCH.D, 1.0)


def test_moving_filter_is_at_rest_for_a_constant_pitch_rate():
    x = np.zeros(N_STATES)
    x[4] = 0.3
    state = extended_state(x, NOTCH)
    assert_allclose(NOTCH.A @ state[N_STATES:] + NOTCH.B * 0.3, 0.0, atol=1e-12)
    assert_allclose(state[4], 0.3, rtol=1e-12)  # both filters pass a constant
