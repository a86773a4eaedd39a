"""The geometry of the airframe and its bending modes."""

import math
from collections import Counter

import numpy as np
import pytest
from published_model import DERIVED, FOOT, SLUG

from hsv.model.airframe.geometry import EIGENVALUE, Cantilever, airframe
from hsv.model.airframe.solids import solids
from hsv.model.vehicle import load_vehicle


def test_lengths_add_up_to_the_published_hundred_feet():
    frame = airframe()
    assert frame.length == pytest.approx(100.0 * FOOT, rel=1e-14)
    assert frame.fore_body == pytest.approx(55.0 * FOOT, rel=1e-14)
    assert frame.inlet_ramp + frame.engine + frame.nozzle_ramp == pytest.approx(frame.length, rel=1e-14)
    assert frame.length * frame.mass_per_length == pytest.approx(load_vehicle().decoupled.mass, rel=1e-12)


def test_angles_close_the_body_at_the_tail():
    # Published as an angle of its own, 14.41 deg, which the other numbers leave no choice of.
    assert math.degrees(airframe().nozzle_ramp_angle) == pytest.approx(14.41, abs=0.005)


LENGTHS = (55.0 * FOOT, 45.0 * FOOT)


@pytest.fixture(params=[0, 1], ids=["fore body", "aft body"])
def beam(request):
    return airframe().cantilevers[request.param]


def test_eigenvalue_is_that_of_the_tables_and_a_root_to_the_last_digits():
    # Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    assert pytest.approx(1.87510407, abs=5e-9) == EIGENVALUE
    # The slope there is -4.1: an error of 4e-15, rounding included, is a residual of 1.6e-14.
    assert abs(1.0 + np.cos(EIGENVALUE) * np.cosh(EIGENVALUE)) < 1.6e-14


def test_modal_mass_is_one(beam):
    x, weights = np.polynomial.legendre.leggauss(40)
    shape = beam.shape(0.5 * beam.length * (x + 1.0))
    assert 0.5 * beam.length * np.sum(weights * beam.mass_per_length * shape**2) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("mode", [0, 1])
def test_its_angular_momentum_is_the_derived_coupling(mode):
    # I q' = M + psi eta'', and what bends upward has the angular momentum int m x w': psi = -int m x phi, x forward.
    beam = Cantilever(LENGTHS[mode], 3.0 * SLUG / FOOT)
    x, weights = np.polynomial.legendre.leggauss(40)
    distance = 0.5 * beam.length * (x + 1.0)
    moment = 0.5 * beam.length * np.sum(weights * beam.mass_per_length * distance * beam.shape(distance))
    coupling = -moment if mode == 0 else moment
    assert coupling / (SLUG**0.5 * FOOT) == pytest.approx(DERIVED[mode], rel=5e-4)


def volume(triangles):
    return float(np.einsum("ij,ij->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6.0)


@pytest.mark.parametrize("solid", solids(), ids=lambda solid: solid.name)
def test_a_solid_is_closed_and_its_triangles_face_outward(solid):
    edges = Counter()
    for corners in solid.triangles.round(9).tolist():
        for i in range(3):
            edges[(tuple(corners[i]), tuple(corners[(i + 1) % 3]))] += 1
    assert all(count == 1 and edges[(end, start)] == 1 for (start, end), count in edges.items())
    assert volume(solid.triangles) > 0.0
