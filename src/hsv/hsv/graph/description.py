"""The graph of nodes, described once: ``hsv run``, the launch file, the nodes and the replay all read this."""

from __future__ import annotations

from dataclasses import dataclass

TOPICS = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/hsv/state": "hsv_msgs/msg/VehicleState",
    "/hsv/forces": "hsv_msgs/msg/VehicleForces",
    "/hsv/filtered_state": "hsv_msgs/msg/FilteredState",
    "/hsv/nominal": "hsv_msgs/msg/NominalState",
    "/hsv/command": "hsv_msgs/msg/ControlInput",
    "/hsv/tube_status": "hsv_msgs/msg/TubeStatus",
    "/hsv/actuator": "hsv_msgs/msg/ControlInput",
    "/hsv/fault_status": "hsv_msgs/msg/FaultStatus",
}
"""Topics with exactly one message a step, in the order in which a step is recorded."""


@dataclass(frozen=True)
class NodeDescription:
    """A node: where its executable is and which step topics it publishes and subscribes."""

    name: str
    package: str
    executable: str
    publishes: tuple[str, ...]
    subscribes: tuple[str, ...]


RECORDER = NodeDescription("recorder", "hsv_bringup", "recorder", (), tuple(TOPICS))
PLANT = NodeDescription("plant", "hsv_plant", "plant", ("/clock", "/hsv/state", "/hsv/forces"), ("/hsv/actuator",))
NOTCH_FILTER = NodeDescription("notch_filter", "hsv_ctrl", "notch_filter", ("/hsv/filtered_state",), ("/hsv/state",))
NOMINAL_TRAJECTORY = NodeDescription(
    "nominal_trajectory", "hsv_ctrl", "nominal_trajectory", ("/hsv/nominal",), ("/hsv/state",)
)
TUBE_MPC = NodeDescription(
    "tube_mpc", "hsv_ctrl", "tube_mpc", ("/hsv/command", "/hsv/tube_status"), ("/hsv/filtered_state", "/hsv/nominal")
)
FAULT_INJECTOR = NodeDescription(
    "fault_injector", "hsv_plant", "fault_injector", ("/hsv/actuator", "/hsv/fault_status"), ("/hsv/command",)
)

GRAPH = (RECORDER, NOTCH_FILTER, NOMINAL_TRAJECTORY, TUBE_MPC, FAULT_INJECTOR, PLANT)
"""All nodes, in start order."""


def node(name: str) -> NodeDescription:
    """Return the description of the node ``name``; KeyError if there is none."""
    return {n.name: n for n in GRAPH}[name]


def links(name: str, recorded: bool) -> list[tuple[str, str]]:
    """Return the (topic, other node) pairs that ``name`` must be matched with, the recorder's only if ``recorded``."""
    me = node(name)
    return [
        (topic, other.name)
        for topic in TOPICS
        for other in GRAPH
        if other is not me
        and (recorded or RECORDER not in (me, other))
        and (
            (topic in me.publishes and topic in other.subscribes)
            or (topic in me.subscribes and topic in other.publishes)
        )
    ]
