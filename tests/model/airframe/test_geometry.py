"""The geometry of the airframe and its bending modes."""

import math
from collections import Counter

import numpy as np
import pytest
from published_model import DERIVED, FOOT, SLUG

from hsv.model.airframe.geometry import EIGENVALUE, Cantilever, airframe
from hsv.model.airframe.pose import BODY, Sample, composed, transforms
from hsv.model.airframe.solids import solids
from hsv.model.vehicle import load_vehicle
from hsv.pages.side_view import geometry


def test_lengths_add_up_to_the_published_hundred_feet():
    frame = airframe()
    assert frame.length == pytest.approx(100.0 * FOOT, rel=1e-14)
    assert frame.fore_body == pytest.approx(55.0 * FOOT, rel=1e-14)
    assert frame.inlet_ramp + frame.engine + frame.nozzle_ramp == pytest.approx(frame.length, rel=1e-14)
    assert frame.length * frame.mass_per_length == pytest.approx(load_vehicle().decoupled.mass, rel=1e-12)


def test_angles_close_the_body_at_the_tail():
    # Published as an angle of its own, 14.41 deg, which the other numbers leave no choice of.
    assert math.degrees(airframe().nozzle_ramp_angle) == pytest.approx(14.41, abs=0.005)


def test_surfaces_meet_at_nose_and_tail_only():
    frame = airframe()
    x = np.linspace(-frame.aft_body, frame.fore_body, 201)
    gap = frame.upper(x) - frame.lower(x)
    assert gap[0] == pytest.approx(0.0, abs=1e-12) and gap[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.all(gap[1:-1] > 0.0)
    assert frame.lower(0.0) < 0.0 < frame.upper(0.0), "the centre of gravity lies inside"


def test_the_engine_lies_where_thrust_has_its_moment():
    frame = airframe()
    assert frame.engine_roof - 0.5 * frame.engine_height == pytest.approx(-8.36 * FOOT, rel=1e-12)
    x, z = frame.elevator_hinge
    assert -frame.aft_body < x - 0.5 * frame.elevator_chord and x + 0.5 * frame.elevator_chord < frame.nozzle
    assert frame.lower(x) < z < frame.upper(x)


def test_outline_of_the_side_view_is_the_body_with_the_modes_at_its_points():
    frame, drawn = airframe(), geometry()
    x, z, mode, shape, slope = np.array(drawn["body"]).T
    on_surface = np.minimum(abs(z - frame.upper(x)), abs(z - frame.lower(x)))
    assert on_surface.max() < 1e-5
    assert x.max() == pytest.approx(frame.fore_body) and x.min() == pytest.approx(-frame.aft_body)
    assert set(mode[x > 0.0]) == {0} and set(mode[x < 0.0]) == {1}
    assert np.all(shape >= 0.0) and np.all(slope * x >= 0.0), "both ends bend up with their coordinate"
    for index, (end, beam) in enumerate(zip((0, -1), frame.cantilevers, strict=True)):
        assert drawn["axis"][end][2:4] == [index, pytest.approx(2.0 / math.sqrt(beam.length * beam.mass_per_length))]


LENGTHS = (55.0 * FOOT, 45.0 * FOOT)


@pytest.fixture(params=[0, 1], ids=["fore body", "aft body"])
def beam(request):
    return airframe().cantilevers[request.param]


def test_eigenvalue_is_that_of_the_tables_and_a_root_to_the_last_digits():
    # Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    assert pytest.approx(1.87510407, abs=5e-9) == EIGENVALUE
    # The slope there is -4.1: an error of 4e-15, rounding included, is a residual of 1.6e-14.
    assert abs(1.0 + np.cos(EIGENVALUE) * np.cosh(EIGENVALUE)) < 1.6e-14


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


@pytest.mark.parametrize("mode", [0, 1])
def test_its_angular_momentum_is_the_derived_coupling(mode):
    # I q' = M + psi eta'', and what bends upward has the angular momentum int m x w': psi = -int m x phi, x forward.
    beam = Cantilever(LENGTHS[mode], 3.0 * SLUG / FOOT)
    x, weights = np.polynomial.legendre.leggauss(40)
    distance = 0.5 * beam.length * (x + 1.0)
    moment = 0.5 * beam.length * np.sum(weights * beam.mass_per_length * distance * beam.shape(distance))
    coupling = -moment if mode == 0 else moment
    assert coupling / (SLUG**0.5 * FOOT) == pytest.approx(DERIVED[mode], rel=5e-4)


AT_REST = Sample(*[0.0] * 6)


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


def test_unbent_segments_are_the_body():
    frame, frames = airframe(), composed(transforms(AT_REST), BODY)
    points = []
    for solid in solids():
        if "body" in solid.name:
            at = frames[solid.frame]
            points.append(solid.triangles.reshape(-1, 3) + np.array([at.x, 0.0, at.z]))
    x, y, z = np.concatenate(points).T
    assert np.minimum(abs(z - frame.upper(x)), abs(z - frame.lower(x))).max() < 1e-12
    assert (x.max(), x.min()) == pytest.approx((frame.fore_body, -frame.aft_body))
    assert np.abs(y).max() == frame.half_width
