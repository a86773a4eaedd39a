"""Frames of the airframe relative to one of them."""

import math

from hsv.model.airframe.pose import LEVEL, Transform, transforms


def composed(sample, root=LEVEL, exaggeration=None):
    """Return the transforms of all frames below ``root`` relative to it."""
    found = {root: Transform(root, root)}
    for own in transforms(sample, exaggeration):
        if outer := found.get(own.parent):
            cos, sin = math.cos(outer.pitch), math.sin(outer.pitch)
            x, z = outer.x + own.x * cos - own.z * sin, outer.z + own.x * sin + own.z * cos
            found[own.child] = Transform(root, own.child, x, z, outer.pitch + own.pitch)
    return found
