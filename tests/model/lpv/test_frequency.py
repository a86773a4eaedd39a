import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.model.lpv.linearisation import bode, bode_difference, frequency_response, zero_order_hold

A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [4.0]])


def test_second_order_system_at_resonance():
    response = frequency_response(A, B, np.array([1e-3, 2.0]))
    magnitude, phase = bode(response[:, 0, 0])
    assert_allclose(magnitude, [0.0, 20.0 * np.log10(5.0)], atol=1e-5)
    assert_allclose(phase, [0.0, -90.0], atol=0.02)


def test_discrete_response_is_the_continuous_one_with_half_a_period_of_delay():
    frequency = np.array([0.5, 1.0])
    discrete = frequency_response(*zero_order_hold(A, B, 0.01), frequency, 0.01)[:, 0, 0]
    continuous = frequency_response(A, B, frequency)[:, 0, 0] * np.exp(-0.5j * frequency * 0.01)
    assert_allclose(discrete, continuous, rtol=1e-4)


def test_difference_in_decibels_and_degrees():
    response = frequency_response(A, B, np.array([1.0]))
    magnitude, phase = bode_difference(response * 1.1 * np.exp(0.2j), response)
    assert_allclose(magnitude, 20.0 * np.log10(1.1))
    assert_allclose(phase, np.degrees(0.2))


def test_frequencies_above_nyquist_are_refused():
    with pytest.raises(DesignError, match="Nyquist"):
        frequency_response(A, B, np.array([400.0]), 0.01)
