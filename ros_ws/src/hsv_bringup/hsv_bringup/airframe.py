"""A node that draws the vehicle of a running graph in RViz2: ``ros2 run hsv_bringup airframe``.

It publishes the bent airframe as markers, and its frames on /tf where tf2_msgs is installed. It subscribes
best-effort, so that no graph waits for it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import partial

from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped, Vector3
from hsv_msgs.msg import Actuator, VehicleState
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from hsv.bags.description import ACTUATOR, MARKERS, STATE
from hsv.base.parameters import Parameter
from hsv.model.airframe.geometry import airframe
from hsv.model.airframe.pose import LEVEL, Sample, Transform, transforms
from hsv.model.airframe.solids import LABEL_COLOUR, LABEL_HEIGHT, LABEL_SIZE, Colour, label, solids
from hsv_node.main import run_node
from hsv_node.middleware import LATEST
from hsv_node.parameters import declare
from hsv_node.process import ProcessNode

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # ROS 2 as wheels has no such package
    TFMessage = None

_LARGEST = airframe().largest_exaggeration
PARAMETERS = (
    Parameter("rate", 25.0, "pictures a second of wall time, at most", "1/s", 0.1, 1e3),
    Parameter("exaggeration", airframe().exaggeration, "of the bending", "", 0.0, _LARGEST, read_only=False),
)


class AirframeNode(ProcessNode):
    """A node that converts state and actuators of a step into poses of the parts of the airframe."""

    def __init__(self) -> None:
        super().__init__("airframe")
        self._rate = declare(self, PARAMETERS)["rate"]
        self._drawn_at = float("-inf")
        self._actuator = Actuator()
        self._markers = self.create_publisher(MarkerArray, MARKERS, 1)
        self._tf = TFMessage and self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(Actuator, ACTUATOR, self._on_actuator, LATEST)
        self.create_subscription(VehicleState, STATE, self._on_state, LATEST)
        self._solids = [
            (solid, [Point(x=x, y=y, z=z) for x, y, z in solid.triangles.reshape(-1, 3).tolist()]) for solid in solids()
        ]

    def _on_actuator(self, actuator: Actuator) -> None:
        self._actuator = actuator

    def _on_state(self, state: VehicleState) -> None:
        now = time.monotonic()
        if now - self._drawn_at < 1.0 / self._rate or state.status == VehicleState.DIVERGED:
            return
        self._drawn_at = now
        exaggeration = self.get_parameter("exaggeration").value
        sample = Sample(
            state.angle_of_attack,
            state.pitch_angle,
            state.elastic_coordinate_1,
            state.elastic_coordinate_2,
            self._actuator.fuel_equivalence_ratio,
            self._actuator.elevator_deflection,
        )
        chain = transforms(sample, exaggeration)
        self._markers.publish(self._marker_array(state.header.stamp, chain, label(exaggeration)))
        if self._tf:
            self._tf.publish(TFMessage(transforms=[_stamped(state.header.stamp, transform) for transform in chain]))

    def _marker_array(self, stamp: object, chain: Sequence[Transform], text: str) -> MarkerArray:
        # All in one frame, so that they are drawn where there is no /tf.
        frames = composed(chain)
        common = {"header": Header(stamp=stamp, frame_id=LEVEL), "action": Marker.ADD}
        markers = []
        for number, (solid, points) in enumerate(self._solids):
            at = frames[solid.frame]
            pose = Pose(position=Point(x=at.x, z=at.z), orientation=_quaternion(at))
            look = {"scale": Vector3(x=1.0, y=1.0, z=1.0), "color": _colour(solid.colour), "points": points}
            markers.append(Marker(ns=solid.name, id=number, type=Marker.TRIANGLE_LIST, pose=pose, **look, **common))
        pose = Pose(position=Point(z=LABEL_HEIGHT))
        look = {"scale": Vector3(z=LABEL_SIZE), "color": _colour(LABEL_COLOUR), "text": text}
        markers.append(Marker(ns="label", type=Marker.TEXT_VIEW_FACING, pose=pose, **look, **common))
        return MarkerArray(markers=markers)


def composed(chain: Sequence[Transform]) -> dict[str, Transform]:
    """Return the transforms of all frames relative to the level frame; ``chain`` lists parents first."""
    found = {LEVEL: Transform(LEVEL, LEVEL)}
    for inner in chain:
        outer = found[inner.parent]
        cos, sin = math.cos(outer.pitch), math.sin(outer.pitch)
        x, z = outer.x + inner.x * cos - inner.z * sin, outer.z + inner.x * sin + inner.z * cos
        found[inner.child] = Transform(LEVEL, inner.child, x, z, outer.pitch + inner.pitch)
    return found


def _stamped(stamp: object, transform: Transform) -> TransformStamped:
    message = TransformStamped(header=Header(stamp=stamp, frame_id=transform.parent), child_frame_id=transform.child)
    message.transform.translation = Vector3(x=transform.x, z=transform.z)
    message.transform.rotation = _quaternion(transform)
    return message


def _quaternion(transform: Transform) -> Quaternion:
    return Quaternion(**dict(zip("xyzw", transform.quaternion, strict=True)))


def _colour(colour: Colour) -> ColorRGBA:
    return ColorRGBA(**dict(zip("rgba", colour, strict=True)))


main = partial(run_node, AirframeNode, "airframe")
