import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError, TrimError
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.model.dynamics import advance, derivative
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

VEHICLE, PERIOD = load_vehicle().decoupled, 0.02
LOW, HIGH = (26060.4, 2407.92), (26243.28, 2484.12)
NEAR = (LOW[0] + 6.096, LOW[1] + 2.54)
RAMP = ((1.0, 3.0), (LOW[0], NEAR[0]), (LOW[1], NEAR[1]), PERIOD, VEHICLE)
"""Two seconds of Case 2's ramp."""


def along(trajectory, steps):
    """Return the states, inputs and defects of all steps."""
    data = trajectory.along(steps)
    return data.state, data.input, data.defect


def test_a_ramp_is_flown_in_the_trim_of_its_climb():
    state, inputs, _ = along(ReferenceTrajectory(*RAMP), 200)
    climb, acceleration = (NEAR[0] - LOW[0]) / 2.0, (NEAR[1] - LOW[1]) / 2.0
    for k in range(50, 150, 7):
        rates = derivative(state[k], inputs[k], VEHICLE)
        assert_allclose(rates, [climb, acceleration, 0, 0, 0, 0, 0, 0, 0], atol=1e-12)
        assert_allclose(state[k, 0], LOW[0] + climb * (k * PERIOD - 1.0), rtol=1e-14)
        assert_allclose(state[k, 1], LOW[1] + acceleration * (k * PERIOD - 1.0), rtol=1e-14)
    for k, point in ((0, LOW), (49, LOW), (150, NEAR), (199, NEAR)):
        assert_array_equal(state[k], trim(VEHICLE, *point).state)


@pytest.mark.parametrize("kind", ["climbing", "static"])
def test_the_defect_is_what_the_nominal_vehicle_does_not_fly_by_itself(kind):
    state, inputs, defect = along(ReferenceTrajectory(*RAMP, kind), 210)
    flown = state.copy()
    for k in range(len(state) - 1):
        flown[k] = advance(flown[k], inputs[k], VEHICLE, PERIOD, 2)
    moves = np.any(state[1:] != state[:-1], axis=1)
    assert_array_equal(defect[:-1][moves], (flown[:-1] - state[1:])[moves])
    assert_array_equal(defect[:-1][~moves], 0.0)
    if kind == "static":
        assert_allclose(defect[:-1], state[:-1] - state[1:], atol=1e-12)
    else:
        # A sequence of climbing trims is nearly a flight, but at its corners the attitude jumps.
        assert np.abs(defect[50:149, 0]).max() < 1e-6 < 0.05 < np.abs(np.diff(state[50:149, 0])).max()
        assert np.abs(defect[49, 2:4]).min() > 1e-4


def test_of_two_equal_times_the_later_value_holds_from_there_on():
    trajectory = ReferenceTrajectory([5.0, 5.0], [LOW[0], HIGH[0]], [LOW[1], HIGH[1]], PERIOD, VEHICLE)
    state, _, defect = along(trajectory, 300)
    assert_array_equal(state[249], trim(VEHICLE, *LOW).state)
    assert_array_equal(state[250], trim(VEHICLE, *HIGH).state)
    assert np.flatnonzero(np.any(defect, axis=1)).tolist() == [249]
    assert_allclose(defect[249], state[249] - state[250], atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reference.times": [1.0, 0.5]}, r"reference\.times\[1\] = 0.5: expected at least 1"),
        ({"reference.times": [-1.0, 0.5]}, r"reference\.times\[0\] = -1.0"),
        ({"reference.times": [0.0]}, r"reference\.altitudes: 2 values, expected as many as reference.times, 1"),
        ({"reference.altitudes": [26060.4, math.nan]}, r"reference\.altitudes\[1\] = nan"),
        ({"reference.altitudes": [26060.4, 30000.0]}, r"reference\.altitudes\[1\] = 30000.0: expected .* 25908 to"),
        (
            {"reference.times": [1.0, 30.0], "reference.blend": 2.0},
            r"reference\.blend = 2: expected at most the time of",
        ),
        (
            {"reference.times": [5.0, 5.0], "reference.blend": 2.0},
            r"reference\.blend = 2: expected 0 with a step, as at",
        ),
        ({"reference.trim": "level"}, r"reference\.trim = 'level': expected one of climbing, static"),
    ],
)
def test_wrong_commands_are_named(changes, message):
    values = {
        "reference.times": [0.0, 60.0],
        "reference.altitudes": [LOW[0], HIGH[0]],
        "reference.velocities": [LOW[1], HIGH[1]],
    }
    with pytest.raises(ParameterError, match=message):
        ReferenceTrajectory.from_parameters(values | changes, PERIOD)


def test_a_ramp_that_no_input_flies_is_refused_with_its_time():
    times = (20.0, 20.05)
    points = (LOW[0], HIGH[0]), (LOW[1], HIGH[1])
    with pytest.raises(TrimError, match=r"reference at 20 s: .*climb rate = "):
        ReferenceTrajectory(times, *points, PERIOD, VEHICLE)
    ReferenceTrajectory(times, *points, PERIOD, VEHICLE, "static")


def test_blended_corners_are_the_ramp_averaged_by_a_triangle():
    blend = 0.5
    points = (1.0, 2.0, 3.0), (LOW[0], NEAR[0], NEAR[0]), (LOW[1], LOW[1], NEAR[1])
    state, *_ = along(ReferenceTrajectory(*points, PERIOD, VEHICLE, blend=blend), 180)
    offsets = np.linspace(-blend, blend, 2001)
    weights = blend - np.abs(offsets)
    for k in range(20, 180):
        for column in (0, 1):
            around = np.interp(k * PERIOD + offsets, points[0], points[1 + column])
            assert_allclose(state[k, column], np.average(around, weights=weights), rtol=1e-9)


def test_a_blended_ramp_is_limited_in_jerk_and_comes_to_rest_exactly():
    blend, length = 1.0, 2.2
    times = (1.2, 1.2 + length)
    state, _, defect = along(ReferenceTrajectory(times, *RAMP[1:], blend=blend), 240)
    for column in (0, 1):
        slope = (NEAR[column] - LOW[column]) / length
        rate = np.diff(state[:, column]) / PERIOD
        bend = np.diff(rate) / PERIOD
        assert_allclose(rate.max(), slope, rtol=1e-9)
        assert_allclose(bend.max(), slope / blend, rtol=0.02)
        assert np.abs(np.diff(bend) / PERIOD).max() < 1.01 * slope / blend**2 + 1e-3
    begun, ended = round((times[0] - blend) / PERIOD), round((times[1] + blend) / PERIOD)
    assert_array_equal(state[: begun + 1], np.tile(trim(VEHICLE, *LOW).state, (begun + 1, 1)))
    assert_array_equal(state[ended:], np.tile(trim(VEHICLE, *NEAR).state, (240 - ended, 1)))
    assert np.all(defect[ended:] == 0.0) and np.all(defect[:begun] == 0.0)


def test_a_blended_corner_is_a_steady_pull_up():
    state, inputs, _ = along(ReferenceTrajectory((1.5, 3.5), *RAMP[1:], blend=1.0), 260)
    path = np.arcsin(np.gradient(state[:, 0], PERIOD) / state[:, 1])
    turn = np.gradient(path, PERIOD)
    assert turn.max() > 1.2e-3
    for k in range(30, 121, 7):
        rates = derivative(state[k], inputs[k], VEHICLE)
        # The velocity increases, too, so the path turns slightly less; the finite difference rounds the peak.
        assert_allclose(state[k, 4], turn[k], atol=0.02 * turn.max())
        assert rates[3] == state[k, 4]
        assert_allclose(rates[[2, 4]], 0.0, atol=1e-12)
    static = along(ReferenceTrajectory((1.5, 3.5), *RAMP[1:], "static", 0.2), 200)[0]
    assert np.all(static[:, 4] == 0.0)
