"""The graph of nodes, described once: ``hsv run``, the launch file, the nodes and the replay all read this."""

from __future__ import annotations

from dataclasses import dataclass, replace

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

OTHER_TOPICS = {
    "/hsv/run": "hsv_msgs/msg/Run",
    "/hsv/ready": "hsv_msgs/msg/Ready",
    "/rosout": "rcl_interfaces/msg/Log",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}
"""Topics beside those with one message a step; recorded at the simulated time at which they arrive."""

EXIT_DIVERGED = 3
"""Exit code of the plant after a flight that left the range of the model."""


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

ROBUST_MPC = replace(TUBE_MPC, name="robust_mpc", executable="robust_mpc")
"""Flies in place of the Tube-MPC controller, on the same topics."""

COMPOSED = NodeDescription("composed", "hsv_bringup", "composed", (), ())
"""All nodes of the graph in one process."""

CONTROLLERS = {node.name: node for node in (TUBE_MPC, ROBUST_MPC)}


PEER_EMULATOR = NodeDescription("peer_emulator", "hsv_bringup", "peer_emulator", (), ())
"""Not of the graph: takes the place of all others when one node is replayed."""

PLAYER = NodeDescription("player", "hsv_bringup", "player", (), ())
"""Not of the graph: republishes a bag."""


def graph(controller: str = TUBE_MPC.name) -> tuple[NodeDescription, ...]:
    """Return all nodes of the graph with the named controller, in start order."""
    return (RECORDER, NOTCH_FILTER, NOMINAL_TRAJECTORY, CONTROLLERS[controller], FAULT_INJECTOR, PLANT)


def peers(name: str, controller: str, recorded: bool) -> list[str]:
    """Return the names of the other nodes, the recorder only if ``recorded``."""
    return [n.name for n in graph(controller) if n.name != name and (recorded or n is not RECORDER)]


def links(name: str, controller: str, recorded: bool) -> list[tuple[str, str]]:
    """Return the (topic, other node) pairs that node ``name`` must be matched with, the recorder's if ``recorded``."""
    nodes = graph(name if name in CONTROLLERS else controller)
    me = next(node for node in nodes if node.name == name)
    return [
        (topic, other.name)
        for topic in TOPICS
        for other in nodes
        if other is not me
        and (recorded or RECORDER not in (me, other))
        and (
            (topic in me.publishes and topic in other.subscribes)
            or (topic in me.subscribes and topic in other.publishes)
        )
    ]
