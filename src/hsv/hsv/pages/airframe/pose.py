"""Poses of the bent airframe: chains of rigid segments whose joints lie on the bent beams.

Axes follow ROS: x forward, y to the left, z up. The frame ``vehicle_carried`` moves with the centre of gravity and
stays level; ``airframe`` is rotated by the pitch angle, ``flight_path`` by the flight-path angle. The frame of a
segment has its origin at the segment's inner end, towards the centre of gravity, and its x axis along the segment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hsv.bags.messages import FRAME
from hsv.pages.airframe.geometry import Airframe, airframe

LEVEL = FRAME
BODY = "airframe"
FLIGHT_PATH = "flight_path"
ENGINE = "engine"
ELEVATOR = "elevator"
FLAMES = ("flame_1", "flame_2", "flame_3")
"""Frames of the three parts of the flame, which slide out of the engine by one, two and three times the same length."""

FORE_SEGMENTS, AFT_SEGMENTS = 5, 4
"""Numbers of rigid segments ahead of the inlet and behind the nozzle; one more on each side reaches to the centre."""

STEEPEST = 0.9
"""Largest sine of a segment's rotation; the elastic coordinates of a diverging flight would exceed it."""


class Sample(NamedTuple):
    """The quantities that determine the pose at one time: angles in rad, elastic coordinates in kg^0.5 m."""

    angle_of_attack: float
    pitch_angle: float
    elastic_coordinate_1: float
    elastic_coordinate_2: float
    fuel_equivalence_ratio: float
    elevator_deflection: float


@dataclass(frozen=True)
class Transform:
    """A frame relative to its parent: origin x, z (m) and rotation about the lateral axis (rad, nose up positive)."""

    parent: str
    child: str
    x: float = 0.0
    z: float = 0.0
    pitch: float = 0.0

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Rotation as a quaternion (x, y, z, w)."""
        return 0.0, -math.sin(0.5 * self.pitch), 0.0, math.cos(0.5 * self.pitch)


def transforms(sample: Sample, exaggeration: float | None = None) -> list[Transform]:
    """Return the transforms of all frames, parents first.

    Args:
        sample: Finite values.
        exaggeration: Factor on the bending; None: the value in ``airframe.toml``.
    """
    frame = airframe()
    scale = frame.exaggeration if exaggeration is None else exaggeration
    elastic = scale * sample.elastic_coordinate_1, scale * sample.elastic_coordinate_2
    found = [
        Transform(LEVEL, BODY, pitch=sample.pitch_angle),
        Transform(LEVEL, FLIGHT_PATH, pitch=sample.pitch_angle - sample.angle_of_attack),
    ]
    for mode, (name, stations) in enumerate(segments(frame).items()):
        found += _chain(frame, name, stations, elastic[mode])
    # The engine is fixed to the clamp of both beams.
    found.append(Transform(BODY, ENGINE, frame.inlet, frame.engine_roof))
    hinge_x, hinge_z = frame.elevator_hinge
    name, origin = segment_at(frame, hinge_x)
    # A positive deflection moves the trailing edge down, which turns the elevator itself nose up.
    found.append(Transform(name, ELEVATOR, hinge_x - origin, hinge_z, sample.elevator_deflection))
    share = min(max(sample.fuel_equivalence_ratio / frame.full_fuel_equivalence_ratio, 0.0), 1.0)
    found += [
        Transform(ENGINE, name, -share * number * frame.engine, 0.0) for number, name in enumerate(FLAMES, start=1)
    ]
    return found


def segments(frame: Airframe) -> dict[str, np.ndarray]:
    """Return the x coordinates (m) of the ends of the body's segments, by part, from the centre of gravity outward."""
    return {
        "fore_body": np.array([0.0, *np.linspace(frame.inlet, frame.fore_body, FORE_SEGMENTS + 1)]),
        "aft_body": np.array([0.0, *np.linspace(frame.nozzle, -frame.aft_body, AFT_SEGMENTS + 1)]),
    }


def segment_at(frame: Airframe, x: float) -> tuple[str, float]:
    """Return the name of the frame of the segment at ``x`` (m), and the x coordinate (m) of the frame's origin."""
    name = "fore_body" if x >= 0.0 else "aft_body"
    stations = np.abs(segments(frame)[name])
    index = min(int(np.searchsorted(stations, abs(x), side="right")), len(stations) - 1)
    return f"{name}_{index}", math.copysign(float(stations[index - 1]), x)


def _chain(frame: Airframe, name: str, stations: np.ndarray, coordinate: float) -> list[Transform]:
    """Return the transforms of a part's rigid segments if its beam is bent by an elastic ``coordinate`` (kg^0.5 m)."""
    height = np.array([frame.shape(x) for x in stations]) * coordinate
    sines = np.clip(np.diff(height) / np.diff(stations), -STEEPEST, STEEPEST)
    found, parent, x, previous = [], BODY, 0.0, 0.0
    for number, (length, pitch) in enumerate(zip(np.diff(stations), np.arcsin(sines), strict=True), start=1):
        child = f"{name}_{number}"
        found.append(Transform(parent, child, x, 0.0, float(pitch) - previous))
        parent, x, previous = child, float(length), float(pitch)
    return found
