"""Between messages and the vectors of the library."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np


def message_class(name: str) -> Any:
    """Return the class of a message type such as ``"hsv_msgs/msg/VehicleState"``."""
    package, kind, message = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), message)


def state_vector(message: Any) -> np.ndarray:
    """Return x (9) from a message with the fields of LongitudinalState."""
    coordinate, rate = message.elastic_coordinate, message.elastic_rate
    return np.array(
        (
            message.altitude,
            message.velocity,
            message.angle_of_attack,
            message.pitch_angle,
            message.pitch_rate,
            coordinate[0],
            rate[0],
            coordinate[1],
            rate[1],
        )
    )


def fill_state(message: Any, x: np.ndarray) -> None:
    """Write x (9) into the fields of LongitudinalState of ``message``."""
    (
        message.altitude,
        message.velocity,
        message.angle_of_attack,
        message.pitch_angle,
        message.pitch_rate,
        coordinate_1,
        rate_1,
        coordinate_2,
        rate_2,
    ) = x.tolist()
    message.elastic_coordinate[:] = coordinate_1, coordinate_2
    message.elastic_rate[:] = rate_1, rate_2


def input_vector(message: Any) -> np.ndarray:
    """Return u (2) from a message with the fields of InputVector."""
    return np.array((message.fuel_equivalence_ratio, message.elevator_deflection))


def fill_input(message: Any, u: np.ndarray) -> None:
    """Write u (2) into the fields of InputVector of ``message``."""
    message.fuel_equivalence_ratio, message.elevator_deflection = u.tolist()
