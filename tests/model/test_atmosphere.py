"""Turbulence against Dryden's autocorrelation and spectrum, gusts against quadrature, density and sound by table."""

import math

import numpy as np
import pytest
from core_calls import atmosphere_step, dryden_cross_map
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.signal import welch

from hsv.base.errors import ParameterError
from hsv.base.units import FOOT
from hsv.core import lib
from hsv.model.atmosphere import ATMOSPHERE_PARAMETERS, atmosphere_data, atmosphere_state
from hsv.model.dynamics import vehicle_struct
from hsv.model.vehicle import load_vehicle

T = 0.02
SPEED = 7900.0 * FOOT
LENGTH = 1750.0 * FOOT
ALTITUDE = 26060.4
SIGMA = 2.0 * FOOT
ALONG, ACROSS, VARIATION = 0, [1, 2], 3
"""Places in the memory of the air."""


def flown(values, steps, seed=0, altitude=ALTITUDE, speed=SPEED):
    data = atmosphere_data(values, T)
    state = atmosphere_state(data)
    return np.array([atmosphere_step(data, state, k, seed, altitude, speed) for k in range(steps)])


@pytest.fixture(scope="module")
def turbulence():
    values = {"turbulence.sigma_forward": SIGMA, "turbulence.sigma_up": SIGMA}
    return flown(values, 400_000)[:, :2].T / SIGMA


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


@pytest.mark.long
def test_turbulence_has_its_variance_and_autocorrelation(turbulence):
    r = SPEED * T / LENGTH
    for axis, law in enumerate((lambda x: math.exp(-x), lambda x: math.exp(-x) * (1.0 - 0.5 * x))):
        w = turbulence[axis]
        for lag in (0, 3, 11, 30):
            # Some 36 000 scales are flown: two percent are four standard deviations.
            assert np.mean(w[: len(w) - lag] * w[lag:]) == pytest.approx(law(lag * r), abs=0.025)
    assert abs(np.mean(turbulence[0] * turbulence[1])) < 0.025


@pytest.mark.long
def test_turbulence_has_drydens_spectrum(turbulence):
    tau = LENGTH / SPEED
    laws = (
        lambda s: 2.0 * tau / np.abs(1.0 + tau * s) ** 2,
        lambda s: tau * np.abs((1.0 + math.sqrt(3.0) * tau * s) / (1.0 + tau * s) ** 2) ** 2,
    )
    for w, law in zip(turbulence, laws, strict=True):
        frequency, density = welch(w, 1.0 / T, nperseg=1024)
        inside = (frequency > 0.1) & (2.0 * np.pi * frequency * tau < 6.0)
        # Welch's density is one-sided, per Hz: twice the two-sided spectrum of noise of unit density.
        expected = 2.0 * law(2j * np.pi * frequency[inside])
        assert_allclose(density[inside] / expected, 1.0, atol=0.25)
        assert np.mean(density[inside] / expected) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("stays", [True, False])
def test_gust_is_the_mean_of_one_minus_cosine(stays):
    d = 100.0

    def shape(x):
        if x < 0.0 or (x > 2.0 * d and not stays):
            return 0.0
        return 1.0 if stays and x > d else 0.5 * (1.0 - math.cos(math.pi * x / d))

    for begin, end in ((0.0, 48.0), (48.0, 96.0), (90.0, 138.0), (170.0, 218.0), (250.0, 298.0), (0.0, 400.0)):
        expected, _ = quad(shape, begin, end, points=[d, 2.0 * d])
        assert lib.hsv_gust_mean(begin, end, d, stays) == pytest.approx(expected / (end - begin), abs=1e-9)


def test_gust_begins_with_its_time_and_carries_its_whole_momentum():
    length = 350.0 * FOOT
    values = {"gust.starts": [0.1], "gust.up": [5.0], "gust.lengths": [length]}
    air = flown(values, 40)
    assert not air[:5, 1].any() and air[5, 1] > 0.0 and not air[20:, 1].any()
    assert air[:, 1].sum() * SPEED * T == pytest.approx(5.0 * length, rel=1e-12)
    assert flown({**values, "gust.stays": [1.0]}, 40)[-1, 1] == pytest.approx(5.0)


def test_wind_is_steady_and_shears_with_altitude():
    values = {"wind.forward": 20.0, "wind.up": -1.0, "wind.shear": 0.01, "wind.shear_altitude": ALTITUDE - 500.0}
    assert_allclose(flown(values, 1), [[25.0, -1.0, 1.0]])


@pytest.mark.long
def test_density_is_off_by_a_constant_and_a_gauss_markov_process():
    assert_allclose(flown({"density.offset": -0.05}, 1)[0, 2], 0.95)
    values = {"density.offset": 0.02, "density.sigma": 0.03, "density.length": 2000.0}
    varied = (flown(values, 200_000)[:, 2] - 1.02) / 0.03
    lag = 30
    assert np.var(varied) == pytest.approx(1.0, abs=0.06)
    correlation = math.exp(-lag * SPEED * T / 2000.0)
    assert np.mean(varied[:-lag] * varied[lag:]) == pytest.approx(correlation, abs=0.06)


def test_speed_of_sound_is_that_of_the_standard_atmosphere():
    # US Standard Atmosphere 1976, geometric altitude.
    table = {0.0: 340.29, 5e3: 320.55, 10e3: 299.53, 15e3: 295.07, 25e3: 298.39, 30e3: 301.71, 40e3: 317.19}
    parker = vehicle_struct(load_vehicle("parker").decoupled)
    for altitude, expected in table.items():
        assert lib.hsv_speed_of_sound(altitude, parker.pointer) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"gust.starts": [1.0, 2.0], "gust.lengths": [10.0]},
            "gust.lengths: 1 values, expected as many as gust.starts, 2",
        ),
        ({"gust.starts": [1.0]}, "gust.lengths: 0 values, expected as many as gust.starts, 1"),
        ({"turbulence.sigma_up": -1.0}, "turbulence.sigma_up = -1.0: expected double from 0 to 50 m/s"),
        ({"density.offset": 3}, "density.offset = 3: expected double"),
    ],
)
def test_what_is_no_atmosphere_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        atmosphere_data(values, T)
