"""The airframe for Foxglove and Lichtblick: a constant scene and the moving frames of its parts."""

from __future__ import annotations

from foxglove.messages import (
    ArrowPrimitive,
    Color,
    FrameTransform,
    FrameTransforms,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    TextPrimitive,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)

from hsv.pages.airframe.geometry import airframe
from hsv.pages.airframe.pose import BODY, FLIGHT_PATH, LEVEL, Sample, transforms
from hsv.pages.airframe.solids import LABEL_COLOUR, LABEL_HEIGHT, LABEL_SIZE, Colour, Solid, label, solids

SCENE_TOPIC = "/hsv/airframe/scene"
TRANSFORMS_TOPIC = "/hsv/airframe/transforms"

RATE = 25.0
"""Maximum rate of the frames (Hz); the period of the faster bending mode is a third of a second."""

_ARROWS: dict[str, Colour] = {FLIGHT_PATH: (0.1, 0.5, 0.25, 1.0), BODY: (0.0, 0.45, 0.7, 1.0)}
"""Frames that have an arrow along their x axis, with the colour of the arrow."""


def scene(time_ns: int, exaggeration: float | None = None, plain: bool = False) -> SceneUpdate:
    """Return the scene, stamped ``time_ns``; send it to each client once, and again when the exaggeration changes.

    It shows the paper's vehicle, or a ``plain`` shape for another one, as :func:`hsv.pages.airframe.solids.solids`.
    """
    stamp = _stamp(time_ns)
    entities = [_entity(solid, stamp) for solid in solids(plain)]
    length = 0.7 * airframe().length
    for frame, colour in _ARROWS.items():
        arrow = ArrowPrimitive(
            pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
            shaft_length=length,
            shaft_diameter=0.12,
            head_length=1.2,
            head_diameter=0.5,
            color=_colour(colour),
        )
        entities.append(SceneEntity(timestamp=stamp, frame_id=frame, id=frame, frame_locked=True, arrows=[arrow]))
    text = TextPrimitive(
        pose=Pose(position=Vector3(z=LABEL_HEIGHT), orientation=Quaternion(w=1.0)),
        billboard=True,
        font_size=LABEL_SIZE,
        color=_colour(LABEL_COLOUR),
        text=label(exaggeration),
    )
    entities.append(SceneEntity(timestamp=stamp, frame_id=LEVEL, id="label", frame_locked=True, texts=[text]))
    return SceneUpdate(entities=entities)


def frame_transforms(sample: Sample, time_ns: int, exaggeration: float | None = None) -> FrameTransforms:
    """Return the transforms of the frames of :func:`scene` for ``sample``, stamped ``time_ns``."""
    stamp = _stamp(time_ns)
    return FrameTransforms(
        transforms=[
            FrameTransform(
                timestamp=stamp,
                parent_frame_id=transform.parent,
                child_frame_id=transform.child,
                translation=Vector3(x=transform.x, y=0.0, z=transform.z),
                rotation=Quaternion(**dict(zip("xyzw", transform.quaternion, strict=True))),
            )
            for transform in transforms(sample, exaggeration)
        ]
    )


def _entity(solid: Solid, stamp: Timestamp) -> SceneEntity:
    points = [Point3(x=x, y=y, z=z) for x, y, z in solid.triangles.reshape(-1, 3).tolist()]
    triangles = TriangleListPrimitive(
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)), points=points, color=_colour(solid.colour)
    )
    return SceneEntity(timestamp=stamp, frame_id=solid.frame, id=solid.name, frame_locked=True, triangles=[triangles])


def _colour(colour: Colour) -> Color:
    return Color(**dict(zip("rgba", colour, strict=True)))


def _stamp(time_ns: int) -> Timestamp:
    return Timestamp(sec=time_ns // 10**9, nsec=time_ns % 10**9)
