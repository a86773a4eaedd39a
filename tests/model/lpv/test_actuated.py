import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid
from scipy.signal import lsim, lti

from hsv.model.actuators import ACTUATOR_SETS, actuator_map
from hsv.model.lpv.actuated import actuator_system, held_behind, respond, sampled_actuators
from hsv.model.lpv.linearisation import zero_order_hold

PERIOD = 0.02
BOTH = (ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"])


def test_the_published_check_of_the_second_order():
    sampled = sampled_actuators((ACTUATOR_SETS["elevator_50"],), PERIOD)
    assert_allclose(sampled.A, [[0.694054, 0.009109], [-22.771946, 0.056440]], atol=5e-7)
    assert_allclose(sampled.B[:, 1], [1.0 - 0.694054, 22.771946], atol=5e-7)
    assert_allclose(sampled.A.ravel(), actuator_map(2, 50.0, 0.7, PERIOD), rtol=1e-12)


def test_the_mean_position_is_that_of_the_continuous_actuator():
    A, B, C, D = actuator_system(BOTH)
    fine = PERIOD / 200
    times = np.arange(0.0, 3 * PERIOD + fine / 2, fine)
    commands = np.array([[0.1, 0.2], [0.3, -0.1], [-0.2, 0.4]])
    held = commands[np.minimum((times / PERIOD + 1e-9).astype(int), 2)]
    _, positions, _ = lsim(lti(A, B, C, D), held, times, interp=False)
    means = [trapezoid(positions[200 * k : 200 * k + 201], dx=fine, axis=0) / PERIOD for k in range(3)]
    states, found = respond(sampled_actuators(BOTH, PERIOD), commands)
    assert_allclose(found, means, atol=1e-4)
    assert_allclose(states[0], 0.0)


@pytest.fixture
def plant():
    generator = np.random.default_rng(3)
    return generator.standard_normal((3, 3)), generator.standard_normal((3, 2))


def test_ideal_hardware_leaves_the_held_system_as_it_is(plant):
    for found, expected in zip(held_behind(*plant, PERIOD), zero_order_hold(*plant, PERIOD), strict=True):
        assert np.array_equal(found, expected)


@pytest.mark.parametrize("delay", [0.003, 0.02, 0.047])
def test_a_delayed_command_acts_when_it_arrives(plant, delay):
    """A pulse of a period, delayed, is a step at the delay less a step a period later."""
    A, B = held_behind(*plant, PERIOD, delay=delay)
    x = np.zeros(len(A))
    for k in range(6):
        x = A @ x + B @ (np.array([1.0, -0.5]) if k == 0 else np.zeros(2))

    def answer(elapsed):
        return zero_order_hold(*plant, elapsed)[1] @ [1.0, -0.5]

    end = 6 * PERIOD - delay
    assert_allclose(x[:3], answer(end) - answer(end - PERIOD), atol=1e-12)
