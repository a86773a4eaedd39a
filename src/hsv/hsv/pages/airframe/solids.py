"""The airframe as triangulated solids, each fixed to a frame of :mod:`hsv.pages.airframe.pose`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from hsv.pages.airframe.geometry import Airframe, Point, airframe
from hsv.pages.airframe.pose import BODY, ELEVATOR, ENGINE, FLAMES, segments

Colour = tuple[float, float, float, float]

BODY_COLOUR: Colour = (0.62, 0.72, 0.82, 1.0)
ENGINE_COLOUR: Colour = (0.28, 0.30, 0.34, 1.0)
ELEVATOR_COLOUR: Colour = (0.84, 0.37, 0.0, 1.0)
FLAME_COLOURS: tuple[Colour, ...] = ((1.0, 0.93, 0.6, 0.95), (1.0, 0.66, 0.15, 0.8), (0.9, 0.3, 0.25, 0.5))

LABEL_COLOUR: Colour = (0.5, 0.55, 0.6, 1.0)
LABEL_HEIGHT, LABEL_SIZE = 5.0, 1.0
"""Height (m) of the label above the centre of gravity, and size (m) of its letters."""

_FLAME_HEIGHTS = (0.85, 0.6, 0.3)
"""Heights of the parts of the flame, relative to the height of the engine."""
_SUNK = 0.8
"""Depth (m) by which the engine reaches into the body, so that no gap opens when the body bends."""


@dataclass(frozen=True)
class Solid:
    """A solid in a frame: triangles [triangle, corner, xyz] in metres, counter-clockwise when seen from outside."""

    frame: str
    name: str
    triangles: np.ndarray
    colour: Colour


def label(exaggeration: float | None = None) -> str:
    """Return the label of the picture, which states the factor ``exaggeration`` on the bending; None: the default."""
    return f"bending x {airframe().exaggeration if exaggeration is None else exaggeration:g}"


@cache
def solids(plain: bool = False) -> tuple[Solid, ...]:
    """Return the solids of the vehicle; ``plain``: a pyramid of the same length for one whose shape is not known."""
    frame = airframe()
    if plain:
        base = 0.06 * frame.length
        section = [(frame.fore_body, 0.0), (-frame.aft_body, base), (-frame.aft_body, -base)]

        def sides(x: float) -> tuple[float, float]:
            half = base * (frame.fore_body - x) / frame.length
            return -half, half

        return (Solid(BODY, "body", _prism(section, sides), BODY_COLOUR),)
    found = []
    for name, stations in segments(frame).items():
        for number, (inner, outer) in enumerate(pairwise(stations), start=1):
            found.append(_segment(frame, f"{name}_{number}", float(inner), float(outer)))
    found.append(_engine(frame))
    found += [_elevator(frame, side) for side in (-1.0, 1.0)]
    found += [
        _flame(frame, name, height, colour)
        for name, height, colour in zip(FLAMES, _FLAME_HEIGHTS, FLAME_COLOURS, strict=True)
    ]
    return tuple(found)


def _segment(frame: Airframe, name: str, inner: float, outer: float) -> Solid:
    fore, aft = max(inner, outer), min(inner, outer)
    section = [
        (fore, float(frame.upper(fore))),
        (aft, float(frame.upper(aft))),
        (aft, float(frame.lower(aft))),
        (fore, float(frame.lower(fore))),
    ]
    triangles = _prism(section, lambda x: (-frame.half_width_at(x), frame.half_width_at(x)))
    return Solid(name, name, triangles - [inner, 0.0, 0.0], BODY_COLOUR)


def _engine(frame: Airframe) -> Solid:
    # The origin of the frame lies in the roof at the inlet. The cowl has a sharp lip.
    length, height, lip = frame.engine, frame.engine_height, 0.15 * frame.engine
    section = [(0.0, _SUNK), (-length, _SUNK), (-length, -height), (-lip, -height), (0.0, -0.9 * height)]
    width = 0.85 * frame.half_width
    return Solid(ENGINE, ENGINE, _prism(section, lambda _: (-width, width)), ENGINE_COLOUR)


def _elevator(frame: Airframe, side: float) -> Solid:
    chord, thickness = frame.elevator_chord, frame.elevator_thickness
    section = [(0.5 * chord, 0.0), (0.0, 0.5 * thickness), (-0.5 * chord, 0.0), (0.0, -0.5 * thickness)]
    ends = sorted((side * frame.half_width, side * (frame.half_width + frame.elevator_span)))
    name = f"elevator_{'left' if side > 0.0 else 'right'}"
    return Solid(ELEVATOR, name, _prism(section, lambda _: (ends[0], ends[1])), ELEVATOR_COLOUR)


def _flame(frame: Airframe, name: str, height: float, colour: Colour) -> Solid:
    # The flame has the length of the engine, which hides it while no fuel burns; its end is tapered.
    length, middle, half = frame.engine, -0.5 * frame.engine_height, 0.5 * height * frame.engine_height
    section = [
        (-0.02 * length, middle + half),
        (-0.6 * length, middle + half),
        (-0.98 * length, middle),
        (-0.6 * length, middle - half),
        (-0.02 * length, middle - half),
    ]
    width = 0.75 * height * frame.half_width
    return Solid(name, name, _prism(section, lambda _: (-width, width)), colour)


def _prism(section: Sequence[Point], sides: Callable[[float], tuple[float, float]]) -> np.ndarray:
    """Return the triangles, shape (n, 3, 3), of a prism; ``sides`` gives its right and left y at a coordinate x.

    ``section`` has the corners (x, z) of the convex side view, counter-clockwise as seen from the right.
    """
    right = [np.array([x, sides(x)[0], z]) for x, z in section]
    left = [np.array([x, sides(x)[1], z]) for x, z in section]
    found = []
    for index in range(1, len(section) - 1):
        found.append((right[0], right[index], right[index + 1]))
        found.append((left[0], left[index + 1], left[index]))
    for index in range(len(section)):
        after = (index + 1) % len(section)
        found.append((right[index], left[index], left[after]))
        found.append((right[index], left[after], right[after]))
    # Drop the degenerate triangles of a section that ends in an edge, as at nose and tail.
    kept = [
        corners for corners in found if np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) > 0
    ]
    return np.array(kept)
