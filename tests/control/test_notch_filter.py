import cmath
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import ParameterError
from hsv.control.notch_filter import NOTCH_PARAMETERS, NotchFilter, NotchSection, series
from hsv.core import lib

PERIOD = 0.02
BASELINE = NotchSection(15.0, 0.02, 15.0, 0.5)
SECOND = NotchSection(19.5, 0.02, 19.5, 0.4)
UNEQUAL = NotchSection(15.0, 0.02, 18.0, 0.5)
DEFAULTS = {p.name: p.default for p in NOTCH_PARAMETERS}


def printed(section, omega):
    """Return equation (38), as printed, at s = j omega."""
    s = 1j * omega
    up = s**2 / section.zero_frequency**2 + 2 * section.zero_damping / section.zero_frequency * s + 1
    down = s**2 / section.pole_frequency**2 + 2 * section.pole_damping / section.pole_frequency * s + 1
    return up / down


def discrete(notch, omega):
    """Return the frequency response of the discrete filter."""
    z = cmath.exp(1j * omega * PERIOD)
    response = 1.0
    d = notch.data
    for i in range(len(d.D)):
        response *= d.C[i] @ np.linalg.solve(z * np.eye(2) - d.A[i], d.B[i]) + d.D[i]
    return response


@pytest.mark.parametrize("section", [BASELINE, SECOND, UNEQUAL])
def test_continuous_realisation_is_the_printed_transfer_function(section):
    A, B, C, D = section.state_space()
    for omega in (0.1, 5.0, section.zero_frequency, 40.0, 150.0):
        response = C @ np.linalg.solve(1j * omega * np.eye(2) - A, B) + D
        assert_allclose(response, printed(section, omega), rtol=1e-12)


def test_the_whole_filter_in_state_space_is_its_sections_one_after_the_other():
    notch = NotchFilter([SECOND, UNEQUAL, BASELINE], PERIOD)
    A, B, C, D = series(notch.data)
    for omega in (0.5, 15.0, 60.0):
        z = cmath.exp(1j * omega * PERIOD)
        assert_allclose(C @ np.linalg.solve(z * np.eye(6) - A, B) + D, discrete(notch, omega), rtol=1e-11)


@pytest.mark.parametrize("section", [BASELINE, SECOND, UNEQUAL])
def test_elsewhere_only_the_frequency_axis_is_warped(section):
    # Bilinear transform with prewarping: H_d(omega) = H(omega_w), omega_w = omega_c tan(omega T/2) / tan(omega_c T/2).
    notch = NotchFilter([section], PERIOD)
    centre = section.zero_frequency
    for omega in np.geomspace(0.01, 150.0, 40):
        warped = centre * math.tan(omega * PERIOD / 2) / math.tan(centre * PERIOD / 2)
        assert_allclose(discrete(notch, omega), printed(section, warped), rtol=1e-9)


def test_sections_in_series_multiply():
    both = NotchFilter([BASELINE, SECOND], PERIOD)
    for omega in (1.0, 15.0, 19.5, 60.0):
        product = discrete(NotchFilter([BASELINE], PERIOD), omega) * discrete(NotchFilter([SECOND], PERIOD), omega)
        assert_allclose(discrete(both, omega), product, rtol=1e-12)
    one, two = NotchFilter([BASELINE], PERIOD), NotchFilter([SECOND], PERIOD)
    for value in np.random.default_rng(1).normal(size=50):
        chained = two.step(one.step(value).filtered_pitch_rate).filtered_pitch_rate
        assert both.step(value).filtered_pitch_rate == pytest.approx(chained, rel=1e-12)


@pytest.mark.parametrize("sections", [[BASELINE], [UNEQUAL], [BASELINE, SECOND]])
def test_starts_at_rest_for_its_first_input(sections):
    notch = NotchFilter(sections, PERIOD)
    for _ in range(1000):
        assert notch.step(0.037).filtered_pitch_rate == pytest.approx(0.037, rel=1e-11)


def test_disabled_filter_passes_the_rate_bit_for_bit():
    notch = NotchFilter.from_parameters({**DEFAULTS, "notch.enabled": False})
    result = notch.step(0.123456789)
    assert result.filtered_pitch_rate == 0.123456789
    assert result.filter_state.shape == (0,)


def test_default_is_the_paper_s_fifteen_radians_a_second():
    assert NotchFilter.from_parameters(DEFAULTS).sections == (BASELINE,)


@pytest.mark.parametrize("frequency", [math.pi / PERIOD, 200.0])
def test_a_centre_the_samples_cannot_show_is_refused(frequency):
    with pytest.raises(ParameterError, match=r"parameter notch.zero_frequency\[0\] = .*: expected less than the"):
        NotchFilter([NotchSection(frequency, 0.02, 15.0, 0.5)], PERIOD)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("notch.zero_frequency", [15], "parameter notch.zero_frequency[0] = 15: expected double array"),
        ("notch.zero_frequency", [], "parameter notch.zero_damping: 1 values, expected as many as"),
        ("notch.zero_frequency", [15.0] * (lib.MAX_SECTIONS + 1), "parameter notch.zero_frequency: 5 values, expected"),
        ("notch.pole_damping", [0.0], "parameter notch.pole_damping[0] = 0.0: expected"),
    ],
)
def test_a_wrong_parameter_is_named(name, value, message):
    with pytest.raises(ParameterError) as caught:
        NotchFilter.from_parameters({**DEFAULTS, name: value})
    assert str(caught.value).startswith(message)
