"""The robot description that is shipped has the frames and joints of the airframe."""

from xml.etree import ElementTree

import numpy as np
import pytest

from hsv.model.airframe.pose import FLAMES, Sample, transforms
from hsv.model.airframe.urdf import urdf

ROBOT = ElementTree.fromstring(urdf())
JOINTS = {joint.find("child").attrib["link"]: joint for joint in ROBOT.iter("joint")}


def numbers(element, attribute):
    return np.array([float(word) for word in element.attrib[attribute].split()])


@pytest.mark.parametrize("sample", [Sample(*[0.0] * 6), Sample(0.02, 0.03, 1.1, 0.9, 0.5, 0.2)], ids=["rest", "flight"])
def test_transforms_are_positions_of_its_joints(sample):
    for transform in transforms(sample):
        joint = JOINTS[transform.child]
        assert joint.find("parent").attrib["link"] == transform.parent
        origin = numbers(joint.find("origin"), "xyz")
        moved = np.array([transform.x, 0.0, transform.z]) - origin
        position = transform.pitch
        if transform.child in FLAMES:
            position = float(moved @ numbers(joint.find("axis"), "xyz"))
            moved -= position * numbers(joint.find("axis"), "xyz")
        np.testing.assert_allclose(moved, 0.0, atol=2e-5)
        if joint.attrib["type"] == "fixed":
            assert position == 0.0
        else:
            limit = joint.find("limit").attrib
            assert float(limit["lower"]) <= position <= float(limit["upper"])
        if joint.attrib["type"] == "revolute":
            assert list(numbers(joint.find("axis"), "xyz")) == [0.0, -1.0, 0.0]
