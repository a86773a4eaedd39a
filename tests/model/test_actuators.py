"""Actuators: published coefficients, the textbook's step response, sets and fields."""

import math

import numpy as np
import pytest
from core_calls import actuator_map, actuator_step
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.model.actuators import ACTUATOR_SETS, actuator_data
from hsv.model.vehicle import load_vehicle

VEHICLE = load_vehicle().coupled()
PERIOD = 0.02
ELEVATOR = "actuator.elevator_deflection"
FUEL = "actuator.fuel_equivalence_ratio"
INF = math.inf


def respond(actuator, commands, h, start=0.0, low=-INF, high=INF, rate=INF, acceleration=INF):
    """Return positions and rates after each command, and mean positions over each period.

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
    # Second order: 50 rad/s, damping 0.7, over 0.02 s. First order: 10 and 20 rad/s.
    assert_allclose(actuator_map(2, 50.0, 0.7, 0.02), (0.694054, 0.009109, -22.771946, 0.056440), atol=5e-7)
    assert 1.0 - actuator_map(1, 10.0, 1.0, 0.02)[0] == pytest.approx(0.18127, abs=5e-6)
    assert 1.0 - actuator_map(1, 20.0, 1.0, 0.02)[0] == pytest.approx(0.32968, abs=5e-6)


@pytest.mark.parametrize(("frequency", "damping"), [(50.0, 0.7), (10.0, 0.9)])
def test_step_response_of_second_order(frequency, damping):
    h = 0.005
    time = h * np.arange(1, 200)
    position, rate, _ = respond((2, frequency, damping), np.ones(199), h)
    damped = frequency * math.sqrt(1.0 - damping**2)
    phase = math.acos(damping)
    decay = np.exp(-damping * frequency * time)
    assert_allclose(position, 1.0 - decay * np.sin(damped * time + phase) / math.sin(phase), atol=1e-12)
    assert_allclose(rate, frequency / math.sin(phase) * decay * np.sin(damped * time), atol=1e-10 * frequency)
    # Overshoot from the textbook, and the largest rate of a unit step at a damping of 0.7.
    fine = respond((2, frequency, damping), np.ones(20000), 1e-4)
    overshoot = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert fine[0].max() == pytest.approx(1.0 + overshoot, abs=1e-5)
    if damping == 0.7:
        assert fine[1].max() == pytest.approx(0.46 * frequency, rel=5e-3)


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
    expected = actuator_map(entry.order, entry.natural_frequency, entry.damping_ratio, 0.005)
    assert_array_equal(data.map[i].ravel(), expected)
    assert VEHICLE.input_minimum[i] <= data.minimum[i] and data.maximum[i] <= VEHICLE.input_maximum[i]
    assert entry.source


def test_fields_replace_those_of_the_set():
    changes = {"set": "elevator_50", "natural_frequency": [30.0], "stop": [0.3]}
    data = actuator_data({f"{ELEVATOR}.{field}": value for field, value in changes.items()}, VEHICLE, PERIOD)
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
