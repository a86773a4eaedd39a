"""The drawn airframe closes, has the published numbers, and turns the way the vehicle does."""

import math

import numpy as np
import pytest
from published_model import FOOT

from hsv.model.airframe.geometry import airframe
from hsv.model.airframe.side_view import geometry
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
