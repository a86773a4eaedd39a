"""The airframe as a robot description: ``python3 -m hsv.model.airframe.urdf > airframe.urdf``.

Its joints are the transforms of :mod:`hsv.model.airframe.pose`; a node that publishes these on /tf animates the robot.
Each solid is represented by its bounding box.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np

from hsv.model.airframe.geometry import airframe
from hsv.model.airframe.pose import ELEVATOR, FLAMES, LEVEL, Sample, Transform, transforms
from hsv.model.airframe.solids import solids
from hsv.model.vehicle import load_vehicle

AT_REST = Sample(*[0.0] * len(Sample._fields))
MOVED = Sample(*[0.01 * number for number in range(1, len(AT_REST) + 1)])


def urdf() -> str:
    """Return the robot description as XML; lengths in metres, angles in radians."""
    robot = ElementTree.Element("robot", name="airframe")
    rest = transforms(AT_REST)
    moved = {t.child for t, other in zip(rest, transforms(MOVED), strict=True) if t != other}
    for name in (LEVEL, *(transform.child for transform in rest)):
        link = ElementTree.SubElement(robot, "link", name=name)
        for solid in solids():
            if solid.frame == name:
                _add_box(link, solid.name, solid.triangles.reshape(-1, 3), solid.colour)
    for transform in rest:
        _add_joint(robot, transform, transform.child in moved)
    ElementTree.indent(robot)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, encoding="unicode")}\n'


def _add_box(link: ElementTree.Element, name: str, points: np.ndarray, colour: tuple[float, ...]) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    visual = ElementTree.SubElement(link, "visual", name=name)
    ElementTree.SubElement(visual, "origin", xyz=_words(0.5 * (low + high)), rpy="0 0 0")
    geometry = ElementTree.SubElement(visual, "geometry")
    ElementTree.SubElement(geometry, "box", size=_words(high - low))
    material = ElementTree.SubElement(visual, "material", name=name)
    ElementTree.SubElement(material, "color", rgba=_words(np.array(colour)))


def _add_joint(robot: ElementTree.Element, transform: Transform, moves: bool) -> None:
    slides = transform.child in FLAMES
    kind = "prismatic" if slides else "revolute" if moves else "fixed"
    joint = ElementTree.SubElement(robot, "joint", name=f"{transform.child}_joint", type=kind)
    ElementTree.SubElement(joint, "parent", link=transform.parent)
    ElementTree.SubElement(joint, "child", link=transform.child)
    ElementTree.SubElement(joint, "origin", xyz=_words(np.array([transform.x, 0.0, transform.z])), rpy="0 0 0")
    if not moves:
        return
    # Flames slide aft; other joints rotate nose up, about the axis to the right.
    ElementTree.SubElement(joint, "axis", xyz="-1 0 0" if slides else "0 -1 0")
    low, high = -0.5 * math.pi, 0.5 * math.pi
    if transform.child == ELEVATOR:
        vehicle = load_vehicle().decoupled
        low, high = vehicle.elevator_deflection_minimum, vehicle.elevator_deflection_maximum
    elif slides:
        low, high = 0.0, len(FLAMES) * airframe().engine
    limits = {"lower": f"{low:.9g}", "upper": f"{high:.9g}", "effort": "0", "velocity": "0"}
    ElementTree.SubElement(joint, "limit", limits)


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{number + 0.0:.6g}" for number in numbers.tolist())


if __name__ == "__main__":
    print(urdf(), end="")
