"""Frames of the bent airframe: joints that hold, ends where the beams are, signs of the vehicle's."""

import math

import numpy as np
import pytest

from hsv.model.airframe.geometry import airframe
from hsv.model.airframe.pose import BODY, ELEVATOR, FLIGHT_PATH, Sample, composed, segments, transforms
from hsv.model.vehicle import load_vehicle

LEVEL_FLIGHT = Sample(0.02, 0.03, 1.1, 0.9, 0.5, 0.2)


def ends(frames, name):
    """Return the joints of a chain in the frame of the others: where each segment begins, and where the last ends."""
    stations = segments(airframe())[name]
    chain = [frames[f"{name}_{number}"] for number in range(1, len(stations))]
    last, length = chain[-1], stations[-1] - stations[-2]
    tip = (last.x + length * math.cos(last.pitch), last.z + length * math.sin(last.pitch))
    return np.array([*((frame.x, frame.z) for frame in chain), tip]), stations


@pytest.mark.parametrize("exaggeration", [1.0, 40.0, 150.0])
@pytest.mark.parametrize("name", ["fore_body", "aft_body"])
def test_joints_lie_on_the_beam_and_segments_keep_their_length(name, exaggeration):
    frame = airframe()
    joints, stations = ends(composed(transforms(LEVEL_FLIGHT, exaggeration), BODY), name)
    coordinate = LEVEL_FLIGHT.elastic_coordinate_1 if name == "fore_body" else LEVEL_FLIGHT.elastic_coordinate_2
    np.testing.assert_allclose(joints[:, 1], [exaggeration * coordinate * frame.shape(x) for x in stations], atol=1e-12)
    lengths = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    np.testing.assert_allclose(lengths, abs(np.diff(stations)), rtol=1e-12)


def test_pitch_path_and_angle_of_attack_are_the_vehicles():
    frames = composed(transforms(LEVEL_FLIGHT))
    assert frames[BODY].pitch == 0.03
    assert frames[BODY].pitch - frames[FLIGHT_PATH].pitch == pytest.approx(0.02, rel=1e-12)
    x, y, z, w = frames[BODY].quaternion
    # In the frames of ROS, y to the left, nose up turns about -y: the nose, on x, rises.
    nose = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    np.testing.assert_allclose(nose, [math.cos(0.03), 0.0, math.sin(0.03)], atol=1e-15)


@pytest.mark.parametrize("deflection", [-0.3, 0.3])
def test_positive_elevator_is_trailing_edge_down(deflection):
    rigid = LEVEL_FLIGHT._replace(elastic_coordinate_1=0.0, elastic_coordinate_2=0.0, elevator_deflection=deflection)
    elevator = composed(transforms(rigid), BODY)[ELEVATOR]
    trailing_edge = elevator.z - 0.5 * airframe().elevator_chord * math.sin(elevator.pitch)
    assert np.sign(trailing_edge - elevator.z) == -np.sign(deflection)
    assert (elevator.x, elevator.z) == pytest.approx(airframe().elevator_hinge)
    # The published lift by elevator is positive and its moment negative: a surface behind, deflected down.
    vehicle = load_vehicle().decoupled
    assert vehicle.lift_elevator > 0.0 > vehicle.moment_elevator and elevator.x < 0.0
