"""Where bags of the first interface version hold what has moved since: the faults of a step, and what is saturated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hsv.graph.description import ACTUATOR, COMMAND, TUBE_STATUS

if TYPE_CHECKING:
    from hsv.recording.reader import Bag

FAULT_STATUS = "hsv/fault_status"
"""The topic of the faults of a step, now said with what the actuators do."""

FORMER_TYPES = {ACTUATOR: "hsv_msgs/msg/ControlInput", FAULT_STATUS: "hsv_msgs/msg/FaultStatus"}
"""By role; that of the faults has no other."""


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
