"""The state estimator compared with scipy's Riccati solution, and its estimates in flight."""

import numpy as np
import pytest
from core_calls import measure
from numpy.testing import assert_allclose
from scipy.linalg import expm, solve_discrete_are

from hsv.base.errors import ParameterError
from hsv.control.estimator import PROCESS_PARAMETERS, Estimator, estimator_data
from hsv.model.dynamics import advance, jacobian
from hsv.model.faults.schedule import fault_rows
from hsv.model.faults.table import SENSOR
from hsv.model.sensors import sensor_data, sensor_state
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

T = 0.02
VEHICLE = load_vehicle().coupled()
START = trim(VEHICLE, 26060.4, 2407.92)
A, B = jacobian(START.state, START.input, VEHICLE)
SENSORS = sensor_data({"sensors.set": "ghv"}, T)
PROCESS = np.array([p.default for p in PROCESS_PARAMETERS])


@pytest.fixture(scope="module")
def estimator():
    return estimator_data({}, SENSORS.noise, VEHICLE, START, T)


def test_gain_solves_the_riccati_equation(estimator):
    whole = np.zeros((11, 11))
    whole[:9, :9], whole[:9, 9:] = A, B
    F, H = expm(whole * T), np.eye(11)[:5]
    Q, R = np.diag((PROCESS * np.sqrt(T)) ** 2), np.diag(SENSORS.noise[:5] ** 2)
    M = solve_discrete_are(F.T, H.T, Q, R)
    expected = M @ H.T @ np.linalg.inv(H @ M @ H.T + R)
    scale = np.abs(expected).max(axis=0)
    assert_allclose(estimator.gain / scale, expected / scale, atol=1e-6)
    # The estimation error decays.
    assert np.abs(np.linalg.eigvals((np.eye(11) - estimator.gain @ H) @ F)).max() < 0.9999


def test_an_offset_of_the_elevator_is_found(estimator):
    """Fly about the trim with a constant elevator offset that the estimator does not know."""
    rows, sensors, ideal, stepped = (
        fault_rows([SENSOR], [], T),
        sensor_state(),
        sensor_data({}, T),
        Estimator(estimator),
    )
    x, command = START.state.copy(), START.input.copy()
    for k in range(200):
        stepped.step(k, measure(ideal, sensors, rows, k, 3, x), command)
        # The feedback of the true state stabilises the vehicle.
        turn = -1.0 * (x[2] - START.state[2]) + 1.5 * (x[3] - START.state[3]) + 0.8 * x[4]
        command = START.input + np.array([0.0, turn])
        x = advance(x, command + np.array([0.0, 0.01]), VEHICLE, T, 2)
    assert np.abs(x[2:4]).max() < 0.5
    assert stepped._state[10] == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    ("values", "noise", "message"),
    [
        ({}, np.zeros(9), "estimator.enabled = true: no noise of altitude, velocity, angle_of_attack, "),
        ({"estimator.noise.pitch_rate": -1.0}, np.ones(9), "estimator.noise.pitch_rate = -1.0: expected"),
        ({"estimator.process.altitude": 0.0}, np.ones(9), "estimator.process.altitude = 0.0: expected"),
    ],
)
def test_what_is_no_estimator_is_refused(values, noise, message):
    with pytest.raises(ParameterError, match=message):
        estimator_data(values, noise, VEHICLE, START, T)
