"""The first mode of a cantilever: its boundary conditions, its equation, its norm and the coupling that follows."""

import numpy as np
import pytest
from published_model import DERIVED, FOOT, SLUG

from hsv.model.airframe.geometry import EIGENVALUE, Cantilever, airframe

LENGTHS = (55.0 * FOOT, 45.0 * FOOT)


@pytest.fixture(params=[0, 1], ids=["fore body", "aft body"])
def beam(request):
    return airframe().cantilevers[request.param]


def test_eigenvalue_is_that_of_the_tables_and_a_root_to_the_last_digits():
    # Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    assert pytest.approx(1.87510407, abs=5e-9) == EIGENVALUE
    # The slope there is -4.1: an error of 4e-15, rounding included, is a residual of 1.6e-14.
    assert abs(1.0 + np.cos(EIGENVALUE) * np.cosh(EIGENVALUE)) < 1.6e-14


def test_clamped_at_the_centre_of_gravity_and_free_at_its_end(beam):
    tip = beam.shape(beam.length)
    assert beam.shape(0.0) == beam.shape(0.0, 1) == 0.0
    for order in (2, 3):
        assert abs(beam.shape(beam.length, order)) * beam.length**order < 1e-12 * tip
        assert abs(beam.shape(0.0, order)) * beam.length**order > tip


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_the_shape(beam, order):
    x, step = np.linspace(0.1, 0.9, 9) * beam.length, 1e-4
    difference = (beam.shape(x + step, order - 1) - beam.shape(x - step, order - 1)) / (2.0 * step)
    np.testing.assert_allclose(difference, beam.shape(x, order), rtol=1e-6)


@pytest.mark.parametrize("frequency", [16.02, 19.58])
def test_it_vibrates_freely_at_the_frequency_of_its_stiffness(beam, frequency):
    # EI w'''' = omega^2 m w
    x = np.linspace(0.0, 1.0, 11) * beam.length
    restoring = beam.bending_stiffness(frequency) * beam.shape(x, 4)
    np.testing.assert_allclose(restoring, frequency**2 * beam.mass_per_length * beam.shape(x), rtol=1e-12)


def test_modal_mass_is_one(beam):
    x, weights = np.polynomial.legendre.leggauss(40)
    shape = beam.shape(0.5 * beam.length * (x + 1.0))
    assert 0.5 * beam.length * np.sum(weights * beam.mass_per_length * shape**2) == pytest.approx(1.0, rel=1e-12)


def test_orthogonal_to_the_second_mode(beam):
    # The second root of 1 + cos b cosh b, from the tables.
    b = 4.69409113
    x, weights = np.polynomial.legendre.leggauss(40)
    x = 0.5 * (x + 1.0)
    ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    second = np.cosh(b * x) - np.cos(b * x) - ratio * (np.sinh(b * x) - np.sin(b * x))
    first = beam.shape(x * beam.length)
    norms = np.sqrt(np.sum(weights * first**2) * np.sum(weights * second**2))
    assert abs(np.sum(weights * first * second)) < 1e-7 * norms


@pytest.mark.parametrize("mode", [0, 1])
def test_its_angular_momentum_is_the_derived_coupling(mode):
    # I q' = M + psi eta'', and what bends upward has the angular momentum int m x w': psi = -int m x phi, x forward.
    beam = Cantilever(LENGTHS[mode], 3.0 * SLUG / FOOT)
    x, weights = np.polynomial.legendre.leggauss(40)
    distance = 0.5 * beam.length * (x + 1.0)
    moment = 0.5 * beam.length * np.sum(weights * beam.mass_per_length * distance * beam.shape(distance))
    coupling = -moment if mode == 0 else moment
    assert coupling / (SLUG**0.5 * FOOT) == pytest.approx(DERIVED[mode], rel=5e-4)
