"""Geometry of the side view of the vehicle, as plain data: outlines with the bending mode at each point."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hsv.pages.airframe.geometry import Airframe, Point, airframe

SPACING = 0.5
"""Maximum distance (m) along x between neighbouring points of an outline."""


@cache
def geometry() -> dict[str, Any]:
    """Return the geometry that the class ``SideView`` of ``vehicle.js`` draws, ready for JSON.

    Points are ``[x, z, mode, shape, slope]``: x and z in body axes (m), the index of the elastic coordinate (kg^0.5 m)
    that bends the vehicle there, and, per unit of it, the deflection (kg^-0.5) and its slope along x (kg^-0.5/m).
    Points of the elevator's outline are ``[x, z]``, relative to the hinge (m).
    """
    frame = airframe()
    chord, thickness = frame.elevator_chord, frame.elevator_thickness
    cowl = frame.engine_roof - frame.engine_height
    ramp = [(frame.nozzle, frame.engine_roof), (frame.inlet, frame.engine_roof)]
    return {
        "length": frame.length,
        "exaggeration": frame.exaggeration,
        "largest_exaggeration": frame.largest_exaggeration,
        "body": _outline(frame, [frame.nose, frame.tail, *ramp]),
        "engine": _outline(frame, [*reversed(ramp), (frame.nozzle, cowl), (frame.inlet, cowl)]),
        "axis": [_point(frame, x, 0.0) for x in np.linspace(frame.fore_body, -frame.aft_body, 62)],
        "elevator": {
            "hinge": _point(frame, *frame.elevator_hinge),
            # Leading edge, top, trailing edge and bottom, relative to the hinge.
            "outline": [[0.5 * chord, 0.0], [0.0, 0.5 * thickness], [-0.5 * chord, 0.0], [0.0, -0.5 * thickness]],
        },
        "flame": {
            "roof": _point(frame, frame.nozzle, frame.engine_roof),
            "cowl": _point(frame, frame.nozzle, cowl),
            "length": 3.0 * frame.engine / frame.full_fuel_equivalence_ratio,
        },
    }


def _outline(frame: Airframe, corners: list[Point]) -> list[list[float]]:
    points = []
    for (x0, z0), (x1, z1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        steps = max(1, int(np.ceil(abs(x1 - x0) / SPACING)))
        for along in np.arange(steps) / steps:
            points.append(_point(frame, x0 + along * (x1 - x0), z0 + along * (z1 - z0)))
    return points


def _point(frame: Airframe, x: float, z: float) -> list[float]:
    x, z, shape, slope = (float(f"{number:.7g}") for number in (x, z, frame.shape(x), frame.shape(x, 1)))
    return [x, z, frame.mode(x), shape, slope]
