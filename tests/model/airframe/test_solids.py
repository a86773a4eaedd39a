"""The pieces that are drawn are closed, and together are the body."""

from collections import Counter

import numpy as np
import pytest

from hsv.model.airframe.geometry import airframe
from hsv.model.airframe.pose import BODY, Sample, composed, transforms
from hsv.model.airframe.solids import solids

AT_REST = Sample(*[0.0] * 6)


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


def test_frames_of_the_solids_are_frames_of_the_airframe():
    assert {solid.frame for solid in solids()} <= {transform.child for transform in transforms(AT_REST)}


def test_unbent_segments_are_the_body():
    frame, frames = airframe(), composed(transforms(AT_REST), BODY)
    points = []
    for solid in solids():
        if "body" in solid.name:
            at = frames[solid.frame]
            points.append(solid.triangles.reshape(-1, 3) + np.array([at.x, 0.0, at.z]))
    x, y, z = np.concatenate(points).T
    assert np.minimum(abs(z - frame.upper(x)), abs(z - frame.lower(x))).max() < 1e-12
    assert (x.max(), x.min()) == pytest.approx((frame.fore_body, -frame.aft_body))
    assert np.abs(y).max() == frame.half_width
