"""Steps of the core that have no public Python function, on arrays and on the data that the library makes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hsv.core import Struct, doubles, lib, records, vector
from hsv.model.faults.schedule import FaultRows

_STRUCTS: dict[tuple[str, int], Struct] = {}
"""By the object that each was filled from, which it keeps alive."""


def pointer(kind: str, source: Any) -> Any:
    """Return the pointer to the struct ``kind`` of ``source``, filled once."""
    key = kind, id(source)
    if key not in _STRUCTS:
        _STRUCTS[key] = Struct(kind, source)
    return _STRUCTS[key].pointer


def written(function: Any, count: int, *arguments: Any) -> np.ndarray:
    """Return the numbers that a ``function`` of the core writes to its last argument."""
    out = np.empty(count)
    function(*(doubles(vector(each)) if isinstance(each, np.ndarray) else each for each in arguments), doubles(out))
    return out


def _faults(rows: FaultRows) -> Any:
    return pointer("hsv_faults", rows)


def begin_faults(rows: FaultRows, step: int, seed: int) -> int:
    """Note in the memory of ``rows`` which of them act in a step; return how many do."""
    return int(lib.hsv_begin_faults(_faults(rows), step, seed))


def command_faults(rows: FaultRows, step: int, seed: int, command: Sequence[float]) -> np.ndarray:
    """Return what reaches the actuators (2) of a ``command`` (2)."""
    actuator = np.array(command, float)
    lib.hsv_apply_command_faults(_faults(rows), step, seed, doubles(actuator))
    return actuator


def engine_faults(rows: FaultRows, step: int, seed: int, alpha: float, mach: float, fuel: float) -> np.ndarray:
    """Return the factors of thrust, lift and drag and the increment of the moment coefficient (4)."""
    return written(lib.hsv_apply_engine_faults, 4, _faults(rows), step, seed, alpha, mach, fuel)


def move_effectors(
    data: Any,
    moved: tuple[np.ndarray, np.ndarray],
    rows: FaultRows,
    step: int,
    substep: float,
    command: np.ndarray,
    alpha: float,
    length: float = 1.0,
) -> None:
    """Move actuators (2, 2) and effectors (2) over ``length`` substeps, in place."""
    state, effector = moved
    lib.hsv_move_effectors(
        pointer("hsv_actuators", data),
        doubles(state),
        _faults(rows),
        step,
        substep,
        length,
        doubles(vector(command)),
        alpha,
        doubles(effector),
    )


def actuator_step(
    order: int, map: Sequence[float], state: Sequence[float], command: float, limits: Sequence[float], h: float
) -> np.ndarray:
    """Return position, rate and mean position (3) ``h`` (s) after a ``state`` (position, rate).

    ``limits``: smallest and largest position, rate limit, acceleration limit.
    """
    return written(lib.hsv_actuator_step, 3, order, np.array(map), np.array(state), command, *limits, h)


def measure(sensors: Any, memory: np.ndarray, rows: FaultRows, step: int, seed: int, x: np.ndarray) -> np.ndarray:
    """Return the measurement (9) of the state ``x`` (9); ``memory`` is that of the sensors."""
    known = records("hsv_sensor_memory", memory)
    return written(lib.hsv_measure, 9, pointer("hsv_sensors", sensors), known, _faults(rows), step, seed, x)


def receive(link: Any, memory: np.ndarray, step: int, seed: int, payload: np.ndarray) -> np.ndarray:
    """Return the payload that the receiver has in a step in which ``payload`` is sent."""
    taken = np.array(payload, float)
    sizes = len(memory), step, seed
    lib.hsv_receive(pointer("hsv_link", link), doubles(memory), *sizes, doubles(taken), len(taken))
    return taken


def atmosphere_step(
    atmosphere: Any, memory: np.ndarray, step: int, seed: int, altitude: float, speed: float
) -> np.ndarray:
    """Return wind forward and up (m/s) and the relative density (3) of a period; ``memory`` is that of the air."""
    given = doubles(memory), step, seed, altitude, speed
    return written(lib.hsv_atmosphere_step, 3, pointer("hsv_atmosphere", atmosphere), *given)


def dryden_cross_map(r: float) -> np.ndarray:
    """Return F (2, 2) and the factor l11, l21, l22 (7) of the turbulence across the path over r = V T / L."""
    return written(lib.hsv_dryden_cross_map, 7, r)
