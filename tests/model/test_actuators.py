"""Actuators against the step responses, limits and coefficients that control engineering has for them."""

import math

import numpy as np
import pytest
from core_calls import actuator_step
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import expm

from hsv.base.errors import ParameterError
from hsv.model.actuators import (
    ACTUATOR_SETS,
    actuator_data,
    actuator_map,
)
from hsv.model.vehicle import load_vehicle

VEHICLE = load_vehicle().coupled()
PERIOD = 0.02
ELEVATOR = "actuator.elevator_deflection"
FUEL = "actuator.fuel_equivalence_ratio"
INF = math.inf


def respond(actuator, commands, h, start=0.0, low=-INF, high=INF, rate=INF, acceleration=INF):
    """Return positions and rates after each command, and the mean positions on the way there.

    ``actuator``: order, natural frequency (rad/s) and damping ratio.
    """
    order, limits = actuator[0], (low, high, rate, acceleration)
    F = actuator_map(*actuator, h)
    rows, p, v = [], start, 0.0
    for command in commands:
        p, v, held = actuator_step(order, F, (p, v), command, limits, h)
        rows.append((p, v, held))
    return np.array(rows).T


def test_coefficients_are_the_published_ones():
    # Second order, 50 rad/s, 0.7, over 0.02 s; first order, 10 and 20 rad/s.
    assert_allclose(actuator_map(2, 50.0, 0.7, 0.02), (0.694054, 0.009109, -22.771946, 0.056440), atol=5e-7)
    assert 1.0 - actuator_map(1, 10.0, 1.0, 0.02)[0] == pytest.approx(0.18127, abs=5e-6)
    assert 1.0 - actuator_map(1, 20.0, 1.0, 0.02)[0] == pytest.approx(0.32968, abs=5e-6)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.5, 400.0), st.floats(0.05, 1.0), st.sampled_from([0.005, 0.02, 0.0025]))
def test_map_of_second_order_is_the_matrix_exponential(frequency, damping, h):
    A = np.array([[0.0, 1.0], [-frequency * frequency, -2.0 * damping * frequency]])
    F = np.reshape(actuator_map(2, frequency, damping, h), (2, 2))
    scale = np.array([[1.0, frequency], [1.0 / frequency, 1.0]])
    assert_allclose(F * scale, expm(A * h) * scale, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("frequency", "damping"), [(50.0, 0.7), (150.0, 0.7), (20.0, 0.7), (10.0, 0.9)])
def test_step_response_of_second_order(frequency, damping):
    h = 0.005
    time = h * np.arange(1, 200)
    position, rate, _ = respond((2, frequency, damping), np.ones(199), h)
    damped = frequency * math.sqrt(1.0 - damping**2)
    phase = math.acos(damping)
    decay = np.exp(-damping * frequency * time)
    assert_allclose(position, 1.0 - decay * np.sin(damped * time + phase) / math.sin(phase), atol=1e-12)
    assert_allclose(rate, frequency / math.sin(phase) * decay * np.sin(damped * time), atol=1e-10 * frequency)
    # The textbook's overshoot, and the largest rate of a unit step at a damping of 0.7.
    assert respond((2, frequency, damping), np.ones(20000), 1e-4)[0].max() == pytest.approx(
        1.0 + math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), abs=1e-5
    )
    if damping == 0.7:
        assert respond((2, frequency, damping), np.ones(20000), 1e-4)[1].max() == pytest.approx(
            0.46 * frequency, rel=5e-3
        )


def test_step_response_of_first_order():
    time = 0.005 * np.arange(1, 100)
    position, _, _ = respond((1, 20.0, 1.0), np.ones(99), 0.005)
    assert_allclose(position, 1.0 - np.exp(-20.0 * time), atol=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_large_step_moves_at_the_rate_limit(order):
    h, limit = 0.005, 0.5
    position, rate, _ = respond((order, 150.0, 0.7), np.full(40, 1.0), h, rate=limit)
    moving = slice(8, 36)
    assert_allclose(np.diff(position)[moving], limit * h, rtol=1e-12)
    assert_allclose(rate[moving], limit, rtol=1e-12)
    assert np.abs(np.diff(position, prepend=0.0)).max() <= limit * h * (1.0 + 1e-12)


def test_rate_changes_within_the_acceleration_limit():
    h, limit = 0.005, 3.0
    position, rate, _ = respond((2, 50.0, 0.7), np.full(400, 0.1), h, acceleration=limit)
    changes = np.abs(np.diff(rate, prepend=0.0))
    assert changes.max() == pytest.approx(limit * h) and changes[0] == pytest.approx(limit * h)
    assert position[-1] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_stops_hold_and_are_left_at_once(order):
    h = 0.005
    commands = np.concatenate((np.full(200, 2.0), np.full(200, -2.0)))
    position, rate, _ = respond((order, 50.0, 0.7), commands, h, low=-0.3, high=0.5)
    assert position.max() == pytest.approx(0.5) and position.min() == pytest.approx(-0.3)
    assert position.max() <= 0.5 and position.min() >= -0.3
    assert rate[199] == pytest.approx(0.0, abs=1e-6)
    assert position[200] < 0.5


@settings(max_examples=100, deadline=None)
@given(st.sampled_from([0, 1, 2]), st.floats(-0.5, 0.5), st.floats(1.0, 400.0), st.floats(0.05, 1.0))
def test_equilibrium_stays_to_the_bit(order, where, frequency, damping):
    position, rate, held = respond(
        (order, frequency, damping), np.full(20, where), 0.005, where, -0.6, 0.6, rate=2.0, acceleration=50.0
    )
    assert_array_equal(position, where)
    assert_array_equal(rate, 0.0)
    assert_array_equal(held, where)


def test_without_parameters_all_is_ideal_within_the_limits_of_the_vehicle():
    data = actuator_data({}, VEHICLE, PERIOD)
    assert data.ideal and not data.order.any()
    assert_array_equal(data.minimum, VEHICLE.input_minimum)
    assert_array_equal(data.maximum, VEHICLE.input_maximum)


@pytest.mark.parametrize("name", ACTUATOR_SETS)
def test_every_set_is_flown_by_its_name(name):
    entry = ACTUATOR_SETS[name]
    data = actuator_data({f"actuator.{entry.channel}.set": name}, VEHICLE, PERIOD)
    i = ("fuel_equivalence_ratio", "elevator_deflection").index(entry.channel)
    assert not data.ideal and data.order[i] == entry.order and data.order[1 - i] == 0
    assert data.rate_limit[i] == entry.rate_limit and data.substep == PERIOD / 4
    assert_array_equal(
        data.map[i].ravel(), actuator_map(entry.order, entry.natural_frequency, entry.damping_ratio, 0.005)
    )
    assert VEHICLE.input_minimum[i] <= data.minimum[i] and data.maximum[i] <= VEHICLE.input_maximum[i]
    assert entry.source


def test_fields_replace_those_of_the_set():
    data = actuator_data(
        {f"{ELEVATOR}.set": "elevator_50", f"{ELEVATOR}.natural_frequency": [30.0], f"{ELEVATOR}.stop": [0.3]},
        VEHICLE,
        PERIOD,
    )
    assert data.natural_frequency[1] == 30.0 and data.damping_ratio[1] == 0.7
    assert (data.minimum[1], data.maximum[1]) == (-0.3, 0.3)
    rate_only = actuator_data({f"{FUEL}.rate_limit": [0.5]}, VEHICLE, PERIOD)
    assert not rate_only.ideal and rate_only.order[0] == 0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({f"{ELEVATOR}.set": "fuel_10"}, "elevator_deflection.set = 'fuel_10': expected one of ideal, elevator_50"),
        ({f"{ELEVATOR}.order": [1.5]}, r"order\[0\] = 1.5: expected double array from 0 to 2, whole"),
        ({f"{ELEVATOR}.order": [2.0]}, "natural_frequency: none given, expected one for an order of 2"),
        ({f"{ELEVATOR}.natural_frequency": [20.0]}, "order: 0, expected 1 or 2"),
        ({f"{ELEVATOR}.rate_limit": [1.0, 2.0]}, "rate_limit: 2 values, expected one"),
        ({f"{ELEVATOR}.rate_limit": [-1.0]}, r"rate_limit\[0\] = -1.0: expected"),
        ({f"{FUEL}.acceleration_limit": [1.0]}, "acceleration_limit: expected none for an order of 0"),
    ],
)
def test_what_is_no_actuator_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        actuator_data(values, VEHICLE, PERIOD)
