"""Sensors: every field affects only its own channel and does so as documented; named sets; faults."""

import math

import numpy as np
import pytest
from core_calls import measure
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.base.units import FOOT
from hsv.model.faults.schedule import fault_rows
from hsv.model.faults.table import SENSOR, Fault
from hsv.model.sensors import SENSOR_SETS, sensor_data, sensor_state
from hsv.model.signals import STATE_NAMES

T = 0.02
NEVER = 2**62
STEPS = 300
STATES = np.array([26000.0, 2400.0, 0.03, 0.04, 0.01, 1.0, 2.0, 0.3, 0.4]) * (
    1.0 + 0.1 * np.sin(np.outer(np.arange(STEPS), np.linspace(0.11, 0.27, 9)))
)
Q = STATE_NAMES.index("pitch_rate")
ALPHA, PITCH = STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")


def measured(values, states=STATES, faults=(), seed=0):
    data, state = sensor_data(values, T), sensor_state()
    rows = fault_rows([SENSOR], [row if len(row) == 3 else (*row, NEVER) for row in faults], T)
    return np.array([measure(data, state, rows, k, seed, x) for k, x in enumerate(states)])


def of_pitch_rate(states=STATES, faults=(), seed=0, **fields):
    """Return the measured pitch rate of a sensor with these fields, and assert that the other channels are ideal."""
    values = {f"sensors.pitch_rate.{name}": [float(value)] for name, value in fields.items()}
    result = measured(values, states, faults, seed)
    others = [i for i in range(9) if i != Q]
    assert_array_equal(result[:, others], states[:, others])
    return result[:, Q]


def still(steps):
    return np.tile(STATES[0], (steps, 1))


def test_constants_are_drawn_once_a_flight():
    assert_allclose(of_pitch_rate(bias=3e-3), STATES[:, Q] + 3e-3, rtol=1e-15)
    assert_allclose(of_pitch_rate(scale=0.02), 1.02 * STATES[:, Q], rtol=1e-15)
    biases = [of_pitch_rate(STATES[:3], seed=seed, bias_sigma=1.0) - STATES[:3, Q] for seed in range(300)]
    assert_allclose(np.ptp(biases, axis=1), 0.0, atol=1e-14)
    assert np.std(biases) == pytest.approx(1.0, rel=0.15)
    scales = [of_pitch_rate(STATES[:1], seed=seed, scale_sigma=0.1)[0] / STATES[0, Q] for seed in range(300)]
    assert np.std(scales) == pytest.approx(0.1, rel=0.15)


def test_drift_begins_with_its_standard_deviation_and_decays_with_its_time():
    for time in (0.5, 1e5):
        data = sensor_data({"sensors.pitch_rate.drift_sigma": [1.0], "sensors.pitch_rate.drift_time": [time]}, T)
        assert (data.drift_sigma[Q], data.drift_decay[Q]) == (1.0, pytest.approx(math.exp(-T / time), rel=1e-12))


def test_lag_latency_quantum_and_range_are_those_of_their_fields():
    states = still(100)
    states[1:, Q] += 0.05
    # A sampled lag: at the first sample after the step, one period has passed.
    expected = states[:, Q] - 0.05 * np.exp(-20.0 * T * np.arange(100)) * (np.arange(100) > 0)
    assert_allclose(of_pitch_rate(states, lag=20.0), expected, atol=1e-15)
    assert_array_equal(of_pitch_rate(latency=3), STATES[np.maximum(np.arange(STEPS) - 3, 0), Q])
    assert_allclose(of_pitch_rate(quantum=1e-4), 1e-4 * np.round(STATES[:, Q] / 1e-4), atol=1e-12)
    assert_array_equal(of_pitch_rate(minimum=0.0095, maximum=0.0104), np.clip(STATES[:, Q], 0.0095, 0.0104))


def test_inertial_angle_of_attack_shares_the_error_of_the_pitch_angle():
    values = {"sensors.pitch_angle.noise": [1e-3], "sensors.pitch_angle.bias": [2e-3]}
    error = measured({**values, "sensors.inertial_angle_of_attack": [1.0]}) - STATES
    assert_allclose(error[:, ALPHA], error[:, PITCH], atol=1e-15)
    assert np.std(error[:, PITCH]) > 5e-4
    assert_array_equal(measured(values)[:, ALPHA], STATES[:, ALPHA])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("fine", [FOOT, 0.1 * FOOT, math.radians(0.005), math.radians(0.005), math.radians(0.01)]),
        ("ghv", [math.sqrt(10.0) * FOOT, FOOT, 1e-3, 1e-3, math.sqrt(1e-5)]),
    ],
)
def test_named_sets_have_their_noise(name, expected):
    # GHV: variances of 10 ft^2, 1 (ft/s)^2, 1e-6 rad^2 (both angles) and 1e-5 (rad/s)^2 (Wiese 2013).
    error = measured({"sensors.set": name}, still(20_000)) - STATES[0]
    assert_allclose(error.std(axis=0)[:5], expected, rtol=0.03)
    assert not error[:, 5:].any()
    assert all(entry.source for entry in SENSOR_SETS.values())


def fault(kind, **parameters):
    return Fault.of("pitch_rate", kind, parameters)


def test_faults_bias_scale_and_run_away():
    expected = STATES[:, Q].copy()
    expected[50:] += 0.02
    assert_array_equal(of_pitch_rate(faults=[(fault("sensor_bias", offset=0.02), 50)]), expected)
    assert_array_equal(of_pitch_rate(faults=[(fault("sensor_scale", factor=0.5), 0)]), 0.5 * STATES[:, Q])
    away = of_pitch_rate(faults=[(fault("sensor_runaway", rate=-0.1, limit=0.3), 20)])
    drift = -np.clip(0.1 * T * (np.arange(STEPS) - 20), 0.0, 0.3)
    assert_allclose(away, STATES[:, Q] + drift, rtol=1e-13, atol=1e-15)


def test_fault_of_noise_and_drop_out():
    noisy = of_pitch_rate(still(5000), [(fault("sensor_noise", standard_deviation=0.01), 1000)]) - STATES[0, Q]
    assert not noisy[:1000].any() and np.std(noisy[1000:]) == pytest.approx(0.01, rel=0.05)
    lost = of_pitch_rate(faults=[(fault("sensor_drop_out", probability=1.0), 50, 90)])
    assert_array_equal(lost[50:90], STATES[49, Q])
    some = of_pitch_rate(faults=[(fault("sensor_drop_out", probability=0.3), 0)])
    assert 0.6 < (some == STATES[:, Q]).mean() < 0.8


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sensors.set": "good"}, "sensors.set = 'good': expected one of ideal, fine, ghv"),
        ({"sensors.pitch_rate.noise": [-1.0]}, r"sensors.pitch_rate.noise\[0\] = -1.0: expected"),
        ({"sensors.pitch_rate.noise": [1.0, 2.0]}, "sensors.pitch_rate.noise: 2 values, expected one"),
        ({"sensors.pitch_rate.drift_sigma": [1e-3]}, "sensors.pitch_rate.drift_sigma: expected with a drift_time only"),
        ({"sensors.altitude.latency": [1.5]}, r"altitude.latency\[0\] = 1.5: expected double array from 0 to 50,"),
        ({"sensors.altitude.minimum": [2.0], "sensors.altitude.maximum": [1.0]}, "minimum = 2 m: expected less than"),
    ],
)
def test_what_is_no_sensor_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        sensor_data(values, T)
