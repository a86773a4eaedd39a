"""Bags of the first interface version: where they hold the faults of a step, and which inputs are limited."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hsv.bags.description import ACTUATOR, COMMAND, RUN, TUBE_STATUS
from hsv.base.errors import RecordingError

if TYPE_CHECKING:
    from hsv.bags.reader import Bag

INTERFACE_VERSION = 2
"""Version of the messages that nodes exchange, as ``hsv_msgs/msg/Run`` has it; the first one did not say it."""

FAULT_STATUS = "hsv/fault_status"
"""The topic of the faults of a step, now said with what the actuators do."""

FORMER_TYPES = {ACTUATOR: "hsv_msgs/msg/ControlInput", FAULT_STATUS: "hsv_msgs/msg/FaultStatus"}
"""Former message types by role; that of the faults has no replacement."""


def require_interface_version(bag: Bag) -> None:
    """Reject a bag with messages of another interface version, which no node of this version accepts.

    Raises:
        RecordingError: Names both versions.
    """
    if RUN not in bag.roles:
        return
    found = bag.constants(RUN).get("INTERFACE_VERSION", 1)
    if found != INTERFACE_VERSION:
        commit = bag.custom_data.get("commit", "unknown")
        raise RecordingError(
            f"{bag.path}: interface version {found}, recorded by commit {commit}: expected version {INTERFACE_VERSION}"
        )


def fault_topic(bag: Bag) -> str:
    """Return the topic whose field ``active`` holds the faults of a step."""
    return FAULT_STATUS if FAULT_STATUS in bag.roles else ACTUATOR


def saturation_topic(bag: Bag) -> str:
    """Return the topic whose field ``saturated`` says which inputs are limited in a step."""
    moved = FAULT_STATUS not in bag.roles or TUBE_STATUS not in bag.roles
    return COMMAND if moved else TUBE_STATUS


def fault_parameters(fault: dict[str, Any]) -> dict[str, float]:
    """Return the parameters of a recorded fault by name; the one type that there was had one, without a name."""
    if "value" in fault:
        return {"effectiveness": float(fault["value"])}
    return dict(zip(fault["parameter_names"], map(float, fault["parameter_values"]), strict=False))
