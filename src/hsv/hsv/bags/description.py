"""The graph of nodes, described once: ``hsv run``, the launch file, the nodes and the replay all read this.

Topics and nodes stand here by their role. What a topic of a running graph is called depends on the namespace and the
remappings of the nodes, and so does what a node is called; a bag says which of its topics plays which role.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

from hsv.base.errors import ParameterError
from hsv.control.controllers import NODE
from hsv.flight import blocks
from hsv.flight.blocks import LOOP, Block
from hsv.model import signals
from hsv.model.signals import SignalType

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
MARKERS = "hsv/airframe"
"""Topic of the airframe node for RViz2; no node of the graph uses it, and no bag contains it."""
WIRE_ALIGNMENT = 4
"""Messages sent over DDS are padded with zeros to a multiple of this number of bytes."""
INJECT_FAULT = "hsv/inject_fault"
CLEAR_FAULT = "hsv/clear_fault"
SET_COMMAND = "hsv/set_command"

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
"""Topics with exactly one message a step, in the order in which a step is recorded; which of them there are depends on
the controller, see :func:`step_topics`."""

CARRIED: dict[str, dict[SignalType, str]] = {
    MEASUREMENT: {signals.MEASUREMENT: "state", signals.STATUS: "status"},
    STATE: {signals.STATE: "altitude", signals.STATUS: "status"},
    FORCES: {signals.FORCES: "lift", signals.EFFECTOR: "effector", signals.AIR: "wind_forward"},
    FILTERED_STATE: {
        signals.MEASUREMENT: "state",
        signals.ESTIMATE: "estimate",
        signals.FILTERED_PITCH_RATE: "filtered_pitch_rate",
        signals.FILTER_STATE: "filter_state",
        signals.STATUS: "status",
    },
    NOMINAL: {
        signals.REFERENCE: "reference",
        signals.REFERENCE_INPUT: "reference_input",
        signals.DEVIATION: "deviation",
        signals.NOMINAL_INPUT: "input",
        signals.GAIN: "gain",
        signals.GAIN_INDEX: "gain_index",
        signals.NOMINAL_STATUS: "status",
    },
    COMMAND: {signals.COMMAND: "fuel_equivalence_ratio", signals.SATURATED: "saturated"},
    TUBE_STATUS: {signals.DIAGNOSTICS: "level"},
    ACTUATOR: {signals.ACTUATOR: "fuel_equivalence_ratio", signals.ACTIVE_FAULTS: "active"},
}
"""The signals of the loop in the messages of a topic, and the field in which each one begins: the message within the
message, the sequence, or the first of the consecutive numbers."""

TOPIC_OF = {signal.name: topic for topic, carried in CARRIED.items() for signal in carried}
"""The topic that carries a signal, by its name; of one that is passed on, the last."""

LATCHED_TOPICS = {
    RUN: "hsv_msgs/msg/Run",
    READY: "hsv_msgs/msg/Ready",
    REFERENCE: "hsv_msgs/msg/Reference",
}
"""Announcements that late joiners receive."""

OTHER_TOPICS = {
    **LATCHED_TOPICS,
    ROSOUT: "rcl_interfaces/msg/Log",
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
    PARAMETER_EVENTS: "rcl_interfaces/msg/ParameterEvent",
}
"""Topics beside those with one message a step; recorded at the simulated time at which they arrive.

Those with a leading slash are ROS's own: every node of a domain has them under this name, in whatever namespace it is.
"""

LAST_STATE = "hsv/last_state"
"""Topic on which the plant says, latched, with which state a run ended: finished, diverged, or running where it was
broken off. One message a run, and not recorded: the bag holds the state itself."""

INTERFACE_VERSION = 3
"""Version of the messages and services, as ``hsv_msgs/msg/Run`` states it."""

EXIT_DIVERGED = 3
"""Exit code of the plant after a flight that left the range of the model."""

LANDED = (0, EXIT_DIVERGED)
"""Exit codes of the process that ends the run, when it has flown to the end."""


@dataclass(frozen=True)
class NodeDescription:
    """A node by its role: where its executable is and which step topics it publishes and subscribes."""

    name: str
    """The role, and the node's name unless it is remapped."""
    package: str
    executable: str
    publishes: tuple[str, ...]
    """Topics in the order in which a step publishes them, those that others wait for first."""
    subscribes: tuple[str, ...]
    known_by: str = ""
    """Type of a message that only this role publishes: who does plays the role, whatever it and its topics are called.

    Empty for what is not a node of the graph.
    """

    announces: tuple[str, ...] = ()
    """Further topics that only this role publishes, not in every step."""
    block: Block | None = None
    """Block that the node steps, if any."""
    delayed: tuple[str, ...] = ()
    """Subscribed topics whose message of the previous step is taken."""
    foreign: bool = False
    """Whether it is not one of this bench's: it knows the messages alone, and announces itself to nobody."""

    @property
    def label(self) -> str:
        """Name of the process in words: its role, or what was started if it is not a node of this bench."""
        return f"{self.package}/{self.executable}" if self.foreign else self.name

    @property
    def own_topics(self) -> tuple[str, ...]:
        """Topics that no other node of the same graph may publish."""
        return self.publishes + self.announces


RECORDER = NodeDescription(
    "recorder",
    "hsv_bringup",
    "recorder",
    (),
    tuple(TOPICS),
    "hsv_msgs/msg/RecorderProgress",
    (RECORDER_PROGRESS,),
)


def _publisher(topic: str) -> Block:
    """Return the last block of the loop that makes a signal of a topic; the other signals are passed on."""
    return next(block for block in reversed(LOOP) if set(block.outputs) & set(CARRIED[topic]))


def _carrying(wanted: Iterable[SignalType]) -> tuple[str, ...]:
    """Return the fewest topics that carry these signals together, of as few the first."""
    choices = (chosen for count in range(len(CARRIED) + 1) for chosen in combinations(CARRIED, count))
    return next(chosen for chosen in choices if set(wanted) <= {s for topic in chosen for s in CARRIED[topic]})


def _stepping(block: Block, package: str, first: str, **others: Any) -> NodeDescription:
    """Return the node that steps ``block``, known by the type of the topic ``first``."""
    publishes = tuple(topic for topic in CARRIED if _publisher(topic) is block)
    needed = _carrying((*block.inputs, *block.delayed))
    delayed = tuple(topic for topic in needed if not {*CARRIED[topic]} & {*block.inputs})
    subscribes = (*delayed, *(topic for topic in needed if topic not in delayed))
    return NodeDescription(
        block.name, package, block.name, publishes, subscribes, TOPICS[first], block=block, delayed=delayed, **others
    )


ESTIMATOR = _stepping(blocks.NOTCH_FILTER, "hsv_ctrl", FILTERED_STATE)
"""The node of the notch filter where an estimator flies, which is told the commands."""

NOTCH_FILTER = replace(ESTIMATOR, subscribes=_carrying(blocks.NOTCH_FILTER.inputs), delayed=())
NOMINAL_TRAJECTORY = _stepping(blocks.NOMINAL_TRAJECTORY, "hsv_ctrl", NOMINAL, announces=(REFERENCE,))
FAULT_INJECTOR = _stepping(blocks.FAULT_INJECTOR, "hsv_plant", ACTUATOR)

_TUBE = _stepping(blocks.CONTROLLER, "hsv_ctrl", COMMAND)

CONTROLLER = replace(_TUBE, publishes=(COMMAND,))
"""Flies any controller of a class of one's own, named by the parameter ``controller``."""

TUBE_MPC, ROBUST_MPC = (replace(_TUBE, name=name, executable=name) for name in ("tube_mpc", "robust_mpc"))
"""Controllers with a node and a name of their own, which publish diagnostics of the tube, too."""

CONTROLLERS = {node.name: node for node in (TUBE_MPC, ROBUST_MPC)}

PLANT = _stepping(blocks.VEHICLE, "hsv_plant", STATE, announces=(RUN, LAST_STATE))
PLANT = replace(PLANT, publishes=(*PLANT.publishes, CLOCK))

COMPOSED = NodeDescription("composed", "hsv_bringup", "composed", (), ())
"""All nodes of the graph in one process."""

PEER_EMULATOR = NodeDescription("peer_emulator", "hsv_bringup", "peer_emulator", (), ())
"""Process outside the graph that replaces all other nodes when one node is replayed."""

PLAYER = NodeDescription("player", "hsv_bringup", "player", (), ())
"""Process outside the graph that republishes a bag."""

LIVE = NodeDescription("live", "hsv_bringup", "live", (), ())
"""Process outside the graph that shows a running flight. No node waits for it, and it ends with the others."""

FAULT, SET_COMMAND_CLIENT, SET_PARAMETER, TOPIC, WATCH = (
    NodeDescription(f"hsv_{name}", "hsv_bringup", name, (), ())
    for name in ("fault", "set_command", "set_parameter", "topic", "watch")
)
"""Processes outside the graph: commands that act on a running one."""


def controller_node(controller: str) -> NodeDescription:
    """Return the node of a controller, named as in a scenario.

    Raises:
        ParameterError: A node without a package or an executable.
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
    """Return what ``role`` is in a graph with or without an ``estimator``."""
    return ESTIMATOR if estimator and role.name == ESTIMATOR.name else role


def graph(controller: str = TUBE_MPC.name, estimator: bool = False) -> tuple[NodeDescription, ...]:
    """Return all nodes of the graph with the named controller, with or without an ``estimator``, in start order."""
    notch_filter = flown_role(NOTCH_FILTER, estimator)
    return (RECORDER, notch_filter, NOMINAL_TRAJECTORY, controller_node(controller), FAULT_INJECTOR, PLANT)


def step_topics(controller: str) -> tuple[str, ...]:
    """Return the topics with one message a step in a graph with the named controller, in order of recording."""
    published = {topic for node in graph(controller) for topic in node.publishes}
    return tuple(topic for topic in TOPICS if topic in published)


def peers(me: NodeDescription, controller: str, recorded: bool, estimator: bool = False) -> list[NodeDescription]:
    """Return the other nodes of the graph that ``me`` flies in, the recorder only if ``recorded``."""
    nodes = graph(me.name if me.name in CONTROLLERS else controller, estimator)
    return [node for node in nodes if node.name != me.name and (recorded or node is not RECORDER)]


def links(
    me: NodeDescription, controller: str, recorded: bool, estimator: bool = False
) -> list[tuple[str, NodeDescription]]:
    """Return the (topic, other node) pairs that ``me`` must be matched with, the recorder's if ``recorded``."""
    return [
        (topic, other)
        for topic in TOPICS
        for other in peers(me, controller, recorded, estimator)
        if topic in {*me.publishes} & {*other.subscribes} | {*me.subscribes} & {*other.publishes}
    ]


ROOT = "/"
"""The namespace of a graph that is not moved."""

LONGEST_NAMESPACE = 200
"""Characters; DDS takes some 250 for a whole topic or service, of which the longest name below takes its part."""


def resolved(topic: str, namespace: str = ROOT) -> str:
    """Return the full name that a topic or service has in ``namespace``, unless it is remapped."""
    return topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"


def checked_namespace(text: str) -> str:
    """Return a namespace as ROS 2 writes it, with its leading slash.

    Raises:
        ParameterError: It is none by the rules of ROS 2.
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
