import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.design.disturbance import DisturbanceSet
from hsv.design.tube_problem import tube_problem
from hsv.design.verification.effects import REACH, air, described, measured, with_models
from hsv.vehicle.dynamics import N_RIGID
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.trim import trim


@pytest.fixture(scope="module")
def problem(subject):
    return tube_problem(subject.design, subject.vehicle, DisturbanceSet(-np.ones(7), np.ones(7)))


@pytest.mark.parametrize("state", range(N_RIGID))
def test_an_error_that_the_sensor_hides_moves_neither_feedback_nor_filter(problem, subject, state):
    bias = np.zeros(N_RIGID)
    bias[state] = 0.01
    effect = measured(np.zeros(N_RIGID), bias)(problem.system)
    hidden = np.zeros(7)
    hidden[state] = -0.01
    system = problem.system
    assert_allclose(system.F @ hidden + effect.feedthrough @ bias, 0.0, atol=1e-15)
    moved = system.A @ hidden + effect.columns @ bias
    assert_allclose(moved[:, :N_RIGID], subject.design.polytope.A[:, :N_RIGID, state] * -0.01, atol=1e-14)
    assert_allclose(moved[:, N_RIGID:], 0.0, atol=1e-15)


@pytest.mark.parametrize(("column", "size"), [(0, 0.5), (1, 0.5), (2, 0.01)])
def test_air_moves_the_vehicle_as_its_equations_say(problem, subject, column, size):
    """A period in air that moves, or is denser, less one in still air, at mid-envelope; 1 % for what is not linear."""
    vehicle, period = subject.vehicle, subject.design.period
    effect = air(vehicle, period, 1.0, 1.0, 1.0)(problem.system)
    point = trim(vehicle.decoupled, *vehicle.centre)
    ends = []
    for acting in (size, 0.0):
        conditions = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
        conditions[column] += acting
        x = point.state.copy()
        advance(x, point.input, vehicle.decoupled, period, 4, workspace(), conditions)
        ends.append(x[:N_RIGID])
    found = effect.columns[0, :N_RIGID, column] * size
    assert_allclose(found, ends[0] - ends[1], rtol=0.01, atol=1e-9 * np.abs(found).max())
    assert not effect.feedthrough.any()


def test_what_is_bounded_by_zero_adds_no_channel(problem, subject):
    still = air(subject.vehicle, subject.design.period)
    assert with_models(problem, [still]).system.G.shape == problem.system.G.shape
    gust = with_models(problem, [still, air(subject.vehicle, subject.design.period, up=2.0)])
    assert gust.system.G.shape[2] == 8
    assert_allclose(gust.disturbance.half_width, [1.0] * 7 + [2.0])


def test_noise_counts_with_its_reach_and_bias_once(problem, subject):
    models = described(subject, sensors="fine", bias=["pitch_angle = -0.1 deg"], turbulence="2 ft/s", density="1 %")
    assert list(models) == [
        "sensors fine",
        "bias of pitch_angle = -0.1 deg",
        "turbulence 2 ft/s",
        "density 1 %",
    ]
    noise, bias, turbulence, density = (model(problem.system).half_width for model in models.values())
    assert noise[0] == pytest.approx(REACH * 0.3048)
    assert_allclose(bias, [0.0, 0.0, 0.0, np.radians(0.1), 0.0])
    assert_allclose(turbulence, [REACH * 0.6096, REACH * 0.6096, 0.0])
    assert_allclose(density, [0.0, 0.0, 0.01])
