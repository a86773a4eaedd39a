import numpy as np
import pytest

from hsv.control.notch_filter import NotchSection
from hsv_paper.modes import highest_peak, peak_falls


def test_a_peak_is_a_local_maximum_and_not_the_edge_of_the_window():
    frequencies = np.linspace(1.0, 10.0, 901)
    response = (0.1 + np.exp(-((frequencies - 4.0) ** 2)) + 5.0 * np.exp(-((frequencies - 8.0) ** 2))).astype(complex)
    found = highest_peak(frequencies, response, 2.0, 7.0)
    assert found.frequency == pytest.approx(4.0, abs=0.02)
    assert found.magnitude == pytest.approx(20.0 * np.log10(1.1), abs=0.01)
    assert highest_peak(frequencies, response, 6.0, 7.5) is None


def test_the_fall_is_from_peak_to_peak_though_the_peak_moves():
    falls = peak_falls([NotchSection(15.0, 0.02, 15.0, 0.5)])
    first, second = falls["first"], falls["second"]
    assert first.before.frequency == pytest.approx(15.64, abs=0.01)
    assert first.after.frequency == pytest.approx(15.86, abs=0.01)
    assert first.decibel == pytest.approx(first.before.magnitude - first.after.magnitude)
    assert first.decibel == pytest.approx(19.4, abs=0.05)
    assert second.decibel == pytest.approx(6.7, abs=0.05)
    assert (first.natural_frequency, second.natural_frequency) == pytest.approx((15.89, 19.47), abs=0.01)


def test_a_filter_at_the_mode_itself_leaves_no_peak():
    fall = peak_falls([NotchSection(15.89, 0.02, 15.89, 0.5)])["first"]
    assert fall.after is None
    assert fall.decibel == float("inf")


def test_the_derived_coupling_has_its_peaks_elsewhere():
    falls = peak_falls([], "derived")
    assert falls["first"].before.frequency == pytest.approx(13.7, abs=0.05)
    assert falls["second"].before.frequency == pytest.approx(18.8, abs=0.05)


def test_no_filter_no_fall():
    assert all(fall.decibel == 0.0 for fall in peak_falls([]).values())
