"""Description of the node graph, shared by ``hsv run``, the launch file, the nodes and the replay.

Topics and nodes are identified by their roles. Their names in a running graph depend on namespace and remappings; a bag
records the names of its topics by role.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from hsv.base.errors import ParameterError
from hsv.control.controller import NODE
from hsv.flight import blocks
from hsv.flight.blocks import Block
from hsv.model.signals import SIGNALS, SignalType

CLOCK = "clock"
STATE = "hsv/state"
MEASUREMENT = "hsv/measurement"
FORCES = "hsv/forces"
FILTERED_STATE = "hsv/filtered_state"
NOMINAL = "hsv/nominal"
COMMAND = "hsv/command"
TUBE_STATUS = "hsv/tube_status"
ACTUATOR = "hsv/actuator"
RUN = "hsv/run"
REFERENCE = "hsv/reference"
READY = "hsv/ready"
RECORDER_PROGRESS = "hsv/recorder_progress"
DIAGNOSTICS = "diagnostics"
ROSOUT = "/rosout"
PARAMETER_EVENTS = "/parameter_events"
WIRE_ALIGNMENT = 4
"""Alignment (bytes) to which the length of a message sent over DDS is padded with zeros."""
INJECT_FAULT = "hsv/inject_fault"
CLEAR_FAULT = "hsv/clear_fault"
SET_COMMAND = "hsv/set_command"
SIMULATION_CONTROL = {
    "GetSimulatorFeatures": "hsv/get_simulator_features",
    "GetSimulationState": "hsv/get_simulation_state",
    "SetSimulationState": "hsv/set_simulation_state",
    "StepSimulation": "hsv/step_simulation",
    "ResetSimulation": "hsv/reset_simulation",
    "GetEntities": "hsv/get_entities",
    "GetEntityState": "hsv/get_entity_state",
    "GetEntitiesStates": "hsv/get_entities_states",
}
"""Services of the plant by their service types in the ROS 2 package ``simulation_interfaces``."""

SIMULATE_STEPS = "hsv/simulate_steps"
"""Action of the plant of the type SimulateSteps of ``simulation_interfaces``."""

TOPICS = {
    CLOCK: "rosgraph_msgs/msg/Clock",
    MEASUREMENT: "hsv_msgs/msg/Measurement",
    STATE: "hsv_msgs/msg/VehicleState",
    FORCES: "hsv_msgs/msg/VehicleForces",
    FILTERED_STATE: "hsv_msgs/msg/FilteredState",
    NOMINAL: "hsv_msgs/msg/NominalState",
    COMMAND: "hsv_msgs/msg/ControlInput",
    TUBE_STATUS: "hsv_msgs/msg/TubeStatus",
    ACTUATOR: "hsv_msgs/msg/Actuator",
}
"""Message types of the step topics, by role, in order of recording. A step topic has exactly one message per step. Not
every controller publishes the tube status, see :func:`step_topics`."""

TOPIC_FIELDS: dict[str, dict[SignalType, str]] = {topic: {} for topic in TOPICS if topic != CLOCK}
"""The signals in the messages of each topic, with the field at which each signal begins, see
:class:`hsv.model.signals.SignalType`."""

for _signal in SIGNALS.values():
    for _topic, _, _field in (place.partition(".") for place in _signal.fields):
        TOPIC_FIELDS[f"hsv/{_topic}"][_signal] = _field

TOPIC_OF = {signal.name: topic for topic, carried in TOPIC_FIELDS.items() for signal in carried}
"""The topic that contains each signal, by the signal's name; the last topic if several contain it."""

LATCHED_TOPICS = {RUN: "hsv_msgs/msg/Run", READY: "hsv_msgs/msg/Ready", REFERENCE: "hsv_msgs/msg/Reference"}
"""Types of the latched topics, whose last message late subscribers receive."""

OTHER_TOPICS = {
    **LATCHED_TOPICS,
    ROSOUT: "rcl_interfaces/msg/Log",
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
    PARAMETER_EVENTS: "rcl_interfaces/msg/ParameterEvent",
}
"""Types of the recorded topics that are not step topics; messages are recorded at the simulated time of arrival.

Topics with a leading slash belong to ROS: they have the same name in every namespace.
"""

TRANSIENT_LOCAL = (*LATCHED_TOPICS, ROSOUT)
"""Topics whose publishers keep messages for late subscribers: the latched ones, and the log of every ROS node."""

LAST_STATE = "hsv/last_state"
"""Latched topic of the last state of a run, one message per run. Its status is finished, diverged, or running if the
run was broken off. It is not recorded, because the bag contains the state."""

INTERFACE_VERSION = 3
"""Version of the messages and services, as announced in ``hsv_msgs/msg/Run``."""

EXIT_DIVERGED = 3
"""Exit code of the plant after a flight that left the range of the model."""

EXIT_INTERRUPTED = 130
"""Exit code of the plant after a flight that a client of the simulation control ended."""

LANDED = (0, EXIT_DIVERGED)
"""Exit codes of the process that ends the run, after a flight that finished or diverged."""


@dataclass(frozen=True)
class NodeDescription:
    """A node by its role: its executable, and the step topics that it publishes and subscribes to."""

    name: str
    """Role of the node, and its name unless it is remapped."""
    package: str
    executable: str
    publishes: tuple[str, ...]
    """Published step topics in the order of publication in a step."""
    subscribes: tuple[str, ...]
    known_by: str = ""
    """Type of a message that only this role publishes. It identifies the node, whose name and topics may be remapped.

    Empty for a process that is not a node of the graph.
    """

    announces: tuple[str, ...] = ()
    """Further topics that only this role publishes, but not in every step."""
    block: Block | None = None
    """Block of the loop that the node steps, if any."""
    delayed: tuple[str, ...] = ()
    """Subscribed topics of which the node uses the message of the previous step."""
    foreign: bool = False
    """Whether the node is external: not of this project, so that it has only the step topics and sends no ``Ready``."""

    @property
    def label(self) -> str:
        """Display name of the process: its role, or package and executable of an external node."""
        return f"{self.package}/{self.executable}" if self.foreign else self.name

    @property
    def own_topics(self) -> tuple[str, ...]:
        """Topics that no other node of the same graph may publish."""
        return self.publishes + self.announces


RECORDER = NodeDescription(
    "recorder", "hsv_bringup", "recorder", (), tuple(TOPICS), "hsv_msgs/msg/RecorderProgress", (RECORDER_PROGRESS,)
)


def _stepping(
    block: Block, package: str, publishes: tuple[str, ...], subscribes: tuple[str, ...], **others: Any
) -> NodeDescription:
    own: dict[str, Any] = {"known_by": TOPICS[publishes[0]], "block": block} | others
    return NodeDescription(block.name, package, block.name, publishes, subscribes, **own)


NOTCH_FILTER = _stepping(blocks.NOTCH_FILTER, "hsv_ctrl", (FILTERED_STATE,), (MEASUREMENT,))
ESTIMATOR = replace(NOTCH_FILTER, subscribes=(COMMAND, MEASUREMENT), delayed=(COMMAND,))
"""The notch filter node with an estimator, which also subscribes to the commands."""

NOMINAL_TRAJECTORY = _stepping(
    blocks.NOMINAL_TRAJECTORY, "hsv_ctrl", (NOMINAL,), (MEASUREMENT,), announces=(REFERENCE,)
)
FAULT_INJECTOR = _stepping(blocks.FAULT_INJECTOR, "hsv_plant", (ACTUATOR,), (COMMAND,))
PLANT = _stepping(
    blocks.VEHICLE,
    "hsv_plant",
    (MEASUREMENT, STATE, FORCES, CLOCK),
    (ACTUATOR,),
    known_by=TOPICS[STATE],
    announces=(RUN, LAST_STATE),
    delayed=(ACTUATOR,),
)

_TUBE = _stepping(blocks.CONTROLLER, "hsv_ctrl", (COMMAND, TUBE_STATUS), (FILTERED_STATE, NOMINAL))

CONTROLLER = replace(_TUBE, publishes=(COMMAND,))
"""The node that steps a custom controller class; the parameter ``controller`` names the class."""

TUBE_MPC, ROBUST_MPC = (replace(_TUBE, name=name, executable=name) for name in ("tube_mpc", "robust_mpc"))
"""Controllers with their own node, which publish diagnostics of the tube as well."""

CONTROLLERS = {node.name: node for node in (TUBE_MPC, ROBUST_MPC)}

COMPOSED = NodeDescription("composed", "hsv_bringup", "composed", (), ())
"""All nodes of the graph in one process."""

PLAYER = NodeDescription("player", "hsv_bringup", "player", (), ())
"""Process outside the graph that republishes a bag."""

LIVE = NodeDescription("live", "hsv_bringup", "live", (), ())
"""Process outside the graph that displays a running flight. No node waits for it; it ends when the nodes end."""

CLIENT = NodeDescription("client", "hsv_bringup", "client", (), ())
"""Process outside the graph that runs a command of ``hsv`` on a running graph, such as ``hsv set``."""


def controller_node(controller: str) -> NodeDescription:
    """Return the node of a controller by its name in a scenario.

    Raises:
        ParameterError: The name of an external node is neither ``node:package/executable`` nor ``node:`` alone.
    """
    if not controller.startswith(NODE):
        return CONTROLLERS.get(controller, CONTROLLER)
    package, slash, executable = controller.removeprefix(NODE).partition("/")
    if controller != NODE and not (
        slash and re.fullmatch(r"[\w.-]+", package) and re.fullmatch(r"[\w.-]+", executable)
    ):
        raise ParameterError(f"controller = {controller!r}: expected {NODE}package/executable, or {NODE} alone")
    return replace(CONTROLLER, package=package, executable=executable, foreign=True)


def flown_role(role: NodeDescription, estimator: bool) -> NodeDescription:
    """Return ``role``, or :data:`ESTIMATOR` if it is the notch filter and the graph has an ``estimator``."""
    return ESTIMATOR if estimator and role.name == ESTIMATOR.name else role


def graph(controller: str = TUBE_MPC.name, estimator: bool = False) -> tuple[NodeDescription, ...]:
    """Return all nodes of the graph with the named controller, with or without an ``estimator``, in start order."""
    notch_filter = flown_role(NOTCH_FILTER, estimator)
    return (RECORDER, notch_filter, NOMINAL_TRAJECTORY, controller_node(controller), FAULT_INJECTOR, PLANT)


def step_topics(controller: str) -> tuple[str, ...]:
    """Return the step topics of a graph with the named controller, in order of recording."""
    published = {topic for node in graph(controller) for topic in node.publishes}
    return tuple(topic for topic in TOPICS if topic in published)


def peers(me: NodeDescription, controller: str, recorded: bool, estimator: bool = False) -> list[NodeDescription]:
    """Return the other nodes of the graph of ``me``; the recorder is included if ``recorded``."""
    nodes = graph(me.name if me.name in CONTROLLERS else controller, estimator)
    return [node for node in nodes if node.name != me.name and (recorded or node is not RECORDER)]


def links(
    me: NodeDescription, controller: str, recorded: bool, estimator: bool = False
) -> list[tuple[str, NodeDescription]]:
    """Return (topic, peer) for each step topic between ``me`` and a peer, in either direction, see :func:`peers`."""
    return [
        (topic, other)
        for topic in TOPICS
        for other in peers(me, controller, recorded, estimator)
        if topic in {*me.publishes} & {*other.subscribes} | {*me.subscribes} & {*other.publishes}
    ]


ROOT = "/"
"""The default namespace of a graph."""

LONGEST_NAMESPACE = 200
"""Maximum number of characters; DDS admits about 250 for a complete name of a topic or service."""


def resolved(topic: str, namespace: str = ROOT) -> str:
    """Return the full name of a topic or service in ``namespace`` without remapping."""
    return topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"


def checked_namespace(text: str) -> str:
    """Return a namespace with its leading slash.

    Raises:
        ParameterError: The text is not a namespace by the rules of ROS 2, or exceeds :data:`LONGEST_NAMESPACE`.
    """
    name = text if text.startswith("/") else f"/{text}"
    if name != ROOT and not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name):
        raise ParameterError(
            f"namespace = {text!r}: expected names of letters, digits and underscores that begin with no digit, "
            "such as /veh1 or /lab/veh1"
        )
    if len(name) > LONGEST_NAMESPACE:
        raise ParameterError(f"namespace of {len(name)} characters: expected at most {LONGEST_NAMESPACE}")
    return name
