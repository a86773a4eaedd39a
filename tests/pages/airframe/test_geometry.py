"""The airframe: published geometry, bending modes, and frames of the deformed body."""

import math
from collections import Counter

import numpy as np
import pytest
from published_model import DERIVED, FOOT, SLUG

from hsv.model.vehicle import load_vehicle
from hsv.pages.airframe.geometry import EIGENVALUE, Cantilever, airframe
from hsv.pages.airframe.pose import BODY, ELEVATOR, FLIGHT_PATH, LEVEL, Sample, Transform, segments, transforms
from hsv.pages.airframe.solids import solids


def composed(sample, root=LEVEL, exaggeration=None):
    """Return the transforms of all frames below ``root`` relative to ``root``."""
    found = {root: Transform(root, root)}
    for own in transforms(sample, exaggeration):
        if outer := found.get(own.parent):
            cos, sin = math.cos(outer.pitch), math.sin(outer.pitch)
            x, z = outer.x + own.x * cos - own.z * sin, outer.z + own.x * sin + own.z * cos
            found[own.child] = Transform(root, own.child, x, z, outer.pitch + own.pitch)
    return found


def test_lengths_add_up_to_the_published_hundred_feet():
    frame = airframe()
    assert frame.length == pytest.approx(100.0 * FOOT, rel=1e-14)
    assert frame.fore_body == pytest.approx(55.0 * FOOT, rel=1e-14)
    assert frame.inlet_ramp + frame.engine + frame.nozzle_ramp == pytest.approx(frame.length, rel=1e-14)
    assert frame.length * frame.mass_per_length == pytest.approx(load_vehicle().decoupled.mass, rel=1e-12)


def test_angles_close_the_body_at_the_tail():
    # The published angle, 14.41 deg, also follows from the other numbers.
    frame = airframe()
    ramp = math.atan2(frame.tail[1] - frame.engine_roof, frame.nozzle_ramp) - frame.upper_surface_angle
    assert math.degrees(ramp) == pytest.approx(14.41, abs=0.005)


LENGTHS = (55.0 * FOOT, 45.0 * FOOT)


@pytest.fixture(params=[0, 1], ids=["fore body", "aft body"])
def beam(request):
    return airframe().cantilevers[request.param]


def test_eigenvalue_is_that_of_the_tables_and_a_root_to_the_last_digits():
    # Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    assert pytest.approx(1.87510407, abs=5e-9) == EIGENVALUE
    # The slope there is -4.1: an error of 4e-15, including rounding, gives a residual of 1.6e-14.
    assert abs(1.0 + np.cos(EIGENVALUE) * np.cosh(EIGENVALUE)) < 1.6e-14


def test_modal_mass_is_one(beam):
    x, weights = np.polynomial.legendre.leggauss(40)
    shape = beam.shape(0.5 * beam.length * (x + 1.0))
    assert 0.5 * beam.length * np.sum(weights * beam.mass_per_length * shape**2) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("mode", [0, 1])
def test_its_angular_momentum_is_the_derived_coupling(mode):
    # I q' = M + psi eta''. Upward bending has the angular momentum int m x w', so psi = -int m x phi, x forward.
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


LEVEL_FLIGHT = Sample(0.02, 0.03, 1.1, 0.9, 0.5, 0.2)


def ends(frames, name):
    """Return the joints of a chain in the root frame: where each segment begins, and where the last one ends."""
    stations = segments(airframe())[name]
    chain = [frames[f"{name}_{number}"] for number in range(1, len(stations))]
    last, length = chain[-1], stations[-1] - stations[-2]
    tip = (last.x + length * math.cos(last.pitch), last.z + length * math.sin(last.pitch))
    return np.array([*((frame.x, frame.z) for frame in chain), tip]), stations


@pytest.mark.parametrize("exaggeration", [1.0, 40.0, 150.0])
@pytest.mark.parametrize("name", ["fore_body", "aft_body"])
def test_joints_lie_on_the_beam_and_segments_keep_their_length(name, exaggeration):
    frame = airframe()
    joints, stations = ends(composed(LEVEL_FLIGHT, BODY, exaggeration), name)
    coordinate = LEVEL_FLIGHT.elastic_coordinate_1 if name == "fore_body" else LEVEL_FLIGHT.elastic_coordinate_2
    np.testing.assert_allclose(joints[:, 1], [exaggeration * coordinate * frame.shape(x) for x in stations], atol=1e-12)
    lengths = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    np.testing.assert_allclose(lengths, abs(np.diff(stations)), rtol=1e-12)


def test_pitch_path_and_angle_of_attack_are_the_vehicles():
    frames = composed(LEVEL_FLIGHT)
    assert frames[BODY].pitch == 0.03
    assert frames[BODY].pitch - frames[FLIGHT_PATH].pitch == pytest.approx(0.02, rel=1e-12)
    x, y, z, w = frames[BODY].quaternion
    # In ROS frames y points left, so nose up is a rotation about -y: the nose, on x, rises.
    nose = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    np.testing.assert_allclose(nose, [math.cos(0.03), 0.0, math.sin(0.03)], atol=1e-15)


@pytest.mark.parametrize("deflection", [-0.3, 0.3])
def test_positive_elevator_is_trailing_edge_down(deflection):
    rigid = LEVEL_FLIGHT._replace(elastic_coordinate_1=0.0, elastic_coordinate_2=0.0, elevator_deflection=deflection)
    elevator = composed(rigid, BODY)[ELEVATOR]
    trailing_edge = elevator.z - 0.5 * airframe().elevator_chord * math.sin(elevator.pitch)
    assert np.sign(trailing_edge - elevator.z) == -np.sign(deflection)
    assert (elevator.x, elevator.z) == pytest.approx(airframe().elevator_hinge)
    # Published lift due to elevator is positive, its moment negative: the surface is aft and deflected down.
    vehicle = load_vehicle().decoupled
    assert vehicle.lift_elevator > 0.0 > vehicle.moment_elevator and elevator.x < 0.0
