import numpy as np
import pytest

from hsv.model.lpv.linearisation import modes


def test_oscillator_has_its_frequency_and_damping():
    (mode,) = modes(np.array([[0.0, 1.0], [-(7.0**2), -2 * 0.3 * 7.0]]))
    assert mode.natural_frequency == pytest.approx(7.0)
    assert mode.damping_ratio == pytest.approx(0.3)
    assert mode.pole.imag > 0.0


def test_real_poles_are_listed_singly_fastest_first():
    found = modes(np.diag([-1.0, 3.0, 0.0]))
    assert [mode.natural_frequency for mode in found] == [3.0, 1.0, 0.0]
    assert [mode.damping_ratio for mode in found] == [-1.0, 1.0, 0.0]
