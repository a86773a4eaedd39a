"""Turbulence by its autocorrelation, gusts by their momentum, density, and speed of sound by a table."""

import math

import numpy as np
import pytest
from core_calls import atmosphere_step, dryden_cross_map
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.base.units import FOOT
from hsv.core import lib
from hsv.model.atmosphere import ATMOSPHERE_PARAMETERS, atmosphere_data, atmosphere_state
from hsv.model.dynamics import vehicle_struct
from hsv.model.vehicle import load_vehicle

T = 0.02
SPEED = 7900.0 * FOOT
ALTITUDE = 26060.4


def flown(values, steps, seed=0, altitude=ALTITUDE, speed=SPEED):
    data = atmosphere_data(values, T)
    state = atmosphere_state(data)
    return np.array([atmosphere_step(data, state, k, seed, altitude, speed) for k in range(steps)])


def test_still_air_is_still():
    assert atmosphere_data({}, T).still
    assert_array_equal(flown({}, 3), [[0.0, 0.0, 1.0]] * 3)
    for parameter in ATMOSPHERE_PARAMETERS:
        assert parameter.description


@pytest.mark.parametrize("r", [0.003, 0.0903, 0.7, 5.0])
def test_cross_filter_has_drydens_autocorrelation_exactly(r):
    *f, l_11, l_21, l_22 = dryden_cross_map(r)
    F, factor = np.reshape(f, (2, 2)), np.array([[l_11, 0.0], [l_21, l_22]])
    assert_allclose(F @ F.T + factor @ factor.T, np.eye(2), atol=1e-12)
    C = 0.5 * np.array([1.0, math.sqrt(3.0)])
    for lag in range(6):
        x = lag * r
        assert C @ np.linalg.matrix_power(F, lag) @ C == pytest.approx(math.exp(-x) * (1.0 - 0.5 * x), abs=1e-12)


def test_gust_begins_with_its_time_and_carries_its_whole_momentum():
    length = 350.0 * FOOT
    values = {"gust.starts": [0.1], "gust.up": [5.0], "gust.lengths": [length]}
    air = flown(values, 40)
    assert not air[:5, 1].any() and air[5, 1] > 0.0 and not air[20:, 1].any()
    assert air[:, 1].sum() * SPEED * T == pytest.approx(5.0 * length, rel=1e-12)
    assert flown({**values, "gust.stays": [1.0]}, 40)[-1, 1] == pytest.approx(5.0)


def test_density_is_off_by_a_constant_and_a_gauss_markov_process():
    assert_allclose(flown({"density.offset": -0.05}, 1)[0, 2], 0.95)
    values = {"density.offset": 0.02, "density.sigma": 0.03, "density.length": 2000.0}
    varied = (flown(values, 20_000)[:, 2] - 1.02) / 0.03
    lag = 30
    assert np.var(varied) == pytest.approx(1.0, abs=0.2)
    correlation = math.exp(-lag * SPEED * T / 2000.0)
    assert np.mean(varied[:-lag] * varied[lag:]) == pytest.approx(correlation, abs=0.2)


def test_speed_of_sound_is_that_of_the_standard_atmosphere():
    # US Standard Atmosphere 1976, geometric altitude.
    table = {0.0: 340.29, 5e3: 320.55, 10e3: 299.53, 15e3: 295.07, 25e3: 298.39, 30e3: 301.71, 40e3: 317.19}
    parker = vehicle_struct(load_vehicle("parker").decoupled)
    for altitude, expected in table.items():
        assert lib.hsv_speed_of_sound(altitude, parker.pointer) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gust.starts": [1.0, 2.0], "gust.lengths": [10.0]}, "gust.lengths: 1 values, expected as many as"),
        ({"gust.starts": [1.0]}, "gust.lengths: 0 values, expected as many as gust.starts, 1"),
        ({"turbulence.sigma_up": -1.0}, "turbulence.sigma_up = -1.0: expected double from 0 to 50 m/s"),
        ({"density.offset": 3}, "density.offset = 3: expected double"),
    ],
)
def test_what_is_no_atmosphere_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        atmosphere_data(values, T)
