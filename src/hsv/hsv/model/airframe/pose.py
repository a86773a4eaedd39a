"""Poses of the pieces of the bent airframe: a chain of rigid segments whose joints lie on the bent beams.

Frames are those of ROS: x forward, y to the left, z up. ``vehicle_carried`` moves with the centre of gravity and stays
level; ``airframe`` is turned by the pitch angle, ``flight_path`` by the path angle. A segment's frame lies in its end
towards the centre of gravity, its x axis along it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hsv.model.airframe.geometry import Airframe, airframe

LEVEL = "vehicle_carried"
BODY = "airframe"
FLIGHT_PATH = "flight_path"
ENGINE = "engine"
ELEVATOR = "elevator"
FLAMES = ("flame_1", "flame_2", "flame_3")
"""Pieces of the flame, one in the other: each slides out of the engine by one, two or three times the same length."""

STEEPEST = 0.9
"""Sine of a segment's turn at most: a flight that diverges has coordinates for which there is no picture."""


class Sample(NamedTuple):
    """Quantities that are drawn at one time, SI: angles in rad, elastic coordinates in kg^0.5 m."""

    angle_of_attack: float
    pitch_angle: float
    elastic_coordinate_1: float
    elastic_coordinate_2: float
    fuel_equivalence_ratio: float
    elevator_deflection: float


@dataclass(frozen=True)
class Transform:
    """A frame in its parent's: origin (m) and turn about the lateral axis (rad), nose up positive."""

    parent: str
    child: str
    x: float = 0.0
    z: float = 0.0
    pitch: float = 0.0

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """The turn as x, y, z, w."""
        return 0.0, -math.sin(0.5 * self.pitch), 0.0, math.cos(0.5 * self.pitch)

    def after(self, outer: Transform) -> Transform:
        """Return this frame in the parent of ``outer``, which is its own parent."""
        cos, sin = math.cos(outer.pitch), math.sin(outer.pitch)
        return Transform(
            outer.parent,
            self.child,
            outer.x + self.x * cos - self.z * sin,
            outer.z + self.x * sin + self.z * cos,
            outer.pitch + self.pitch,
        )


def transforms(sample: Sample, exaggeration: float | None = None) -> list[Transform]:
    """Return every frame in its parent's, parents first.

    Args:
        sample: Finite numbers.
        exaggeration: Factor on the bending; default: that of ``airframe.toml``.
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
    # At the clamp of both beams.
    found.append(Transform(BODY, ENGINE, frame.inlet, frame.engine_roof))
    hinge_x, hinge_z = frame.elevator_hinge
    name, origin = segment_at(frame, hinge_x)
    # Positive: trailing edge down, which is nose up for the elevator itself.
    found.append(Transform(name, ELEVATOR, hinge_x - origin, hinge_z, sample.elevator_deflection))
    share = min(max(sample.fuel_equivalence_ratio / frame.full_fuel_equivalence_ratio, 0.0), 1.0)
    found += [
        Transform(ENGINE, name, -share * number * frame.engine, 0.0) for number, name in enumerate(FLAMES, start=1)
    ]
    return found


def composed(chain: Sequence[Transform], root: str = LEVEL) -> Mapping[str, Transform]:
    """Return the frames below ``root``, each in it; parents come first in ``chain``."""
    found = {root: Transform(root, root)}
    for transform in chain:
        if transform.parent in found:
            found[transform.child] = transform.after(found[transform.parent])
    return found


def segments(frame: Airframe) -> dict[str, np.ndarray]:
    """Return the ends of the segments, from the centre of gravity outward, by the stem of their names."""
    return {"fore_body": frame.fore_stations, "aft_body": frame.aft_stations}


def segment_at(frame: Airframe, x: float) -> tuple[str, float]:
    """Return the frame of the segment at a station, and the station of its origin."""
    name = "fore_body" if x >= 0.0 else "aft_body"
    stations = np.abs(segments(frame)[name])
    index = min(int(np.searchsorted(stations, abs(x), side="right")), len(stations) - 1)
    return f"{name}_{index}", math.copysign(float(stations[index - 1]), x)


def _chain(frame: Airframe, name: str, stations: np.ndarray, coordinate: float) -> list[Transform]:
    """Return the segments of a beam: joints on it, lengths kept."""
    height = np.array([frame.shape(x) for x in stations]) * coordinate
    rise = np.clip(np.diff(height) / np.diff(stations), -STEEPEST, STEEPEST)
    found, parent, at, before = [], BODY, 0.0, 0.0
    for number, (length, turn) in enumerate(zip(np.diff(stations), np.arcsin(rise), strict=True), start=1):
        child = f"{name}_{number}"
        found.append(Transform(parent, child, at, 0.0, float(turn) - before))
        parent, at, before = child, float(length), float(turn)
    return found
