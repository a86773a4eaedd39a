"""Discretisation, extended models, modes and frequency responses; actuators and delays in front of the vehicle."""

import numpy as np
import pytest
from core_calls import actuator_map
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import trapezoid
from scipy.signal import lsim, lti

from hsv.base.errors import DesignError
from hsv.control.notch_filter import NotchSection, continuous, series
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.dynamics import jacobian
from hsv.model.lpv.actuated import actuator_system, held_behind, respond, sampled_actuators
from hsv.model.lpv.linearisation import (
    Filter,
    bode,
    bode_difference,
    extended_derivative,
    extended_jacobian,
    extended_state,
    frequency_response,
    from_true_rate,
    linearise,
    modes,
    zero_order_hold,
)
from hsv.model.lpv.polytopic import polytopic_model
from hsv.model.signals import N_STATES
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle


def test_double_integrator_is_exact():
    A, B = zero_order_hold(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.02)
    assert_allclose(A, [[1.0, 0.02], [0.0, 1.0]], rtol=1e-15)
    assert_allclose(B, [[0.5 * 0.02**2], [0.02]], rtol=1e-15)


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


ALTITUDES = np.linspace(*load_vehicle().altitude_range, 4)
VELOCITIES = np.linspace(*load_vehicle().velocity_range, 5)


@pytest.fixture(scope="module")
def polytope():
    counts = len(ALTITUDES), len(VELOCITIES)
    return polytopic_model(load_vehicle(), None, 0.02, counts, (np.ones(N_STATES), np.ones(2))).polytope


def test_model_at_a_node_is_the_vertex(polytope):
    for i, j in ((0, 0), (1, 3), (3, 4)):
        A, B = polytope.at(ALTITUDES[i], VELOCITIES[j])
        expected_A, expected_B = zero_order_hold(
            *linearise(load_vehicle().coupled(), ALTITUDES[i], VELOCITIES[j]), 0.02
        )
        assert_allclose(A, expected_A, rtol=1e-13, atol=1e-16)
        assert_allclose(B, expected_B, rtol=1e-13, atol=1e-16)


def test_linearisation_has_the_structural_modes_and_no_inertial_coupling():
    A, _ = linearise(load_vehicle().coupled("derived"), 25908.0, 2347.594)
    assert_array_equal(A[:5, 5:], 0.0)
    modes = np.linalg.eigvals(A[5:, 5:])
    assert_allclose(np.sort(np.abs(modes)), [16.02, 16.02, 19.58, 19.58], rtol=1e-12)
    # Control study, section 1: the unstable pole over the envelope.
    assert 1.65 < np.linalg.eigvals(A).real.max() < 1.80


def test_oscillator_has_its_frequency_and_damping():
    (mode,) = modes(np.array([[0.0, 1.0], [-(7.0**2), -2 * 0.3 * 7.0]]))
    assert mode.natural_frequency == pytest.approx(7.0)
    assert mode.damping_ratio == pytest.approx(0.3)
    assert mode.pole.imag > 0.0
    assert [mode.damping_ratio for mode in modes(np.diag([2.0, 0.0]))] == [-1.0, 0.0]


A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [4.0]])


def test_second_order_system_at_resonance():
    response = frequency_response(A, B, np.array([1e-3, 2.0]))
    magnitude, phase = bode(response[:, 0, 0])
    assert_allclose(magnitude, [0.0, 20.0 * np.log10(5.0)], atol=1e-5)
    assert_allclose(phase, [0.0, -90.0], atol=0.02)
    assert_allclose(bode_difference(2j * response, response), [np.full((2, 2, 1), x) for x in (20.0 * np.log10(2), 90)])


def test_frequencies_above_nyquist_are_refused():
    with pytest.raises(DesignError, match="Nyquist"):
        frequency_response(A, B, np.array([400.0]), 0.01)


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
    """A delayed pulse of one period is a step at the delay minus a step one period later."""
    A, B = held_behind(*plant, PERIOD, delay=delay)
    x = np.zeros(len(A))
    for k in range(6):
        x = A @ x + B @ (np.array([1.0, -0.5]) if k == 0 else np.zeros(2))

    def answer(elapsed):
        return zero_order_hold(*plant, elapsed)[1] @ [1.0, -0.5]

    end = 6 * PERIOD - delay
    assert_allclose(x[:3], answer(end) - answer(end - PERIOD), atol=1e-12)
