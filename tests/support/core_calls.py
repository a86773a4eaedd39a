"""Functions of the core that have no public Python function, called with arrays and the library's structs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hsv.control.effectiveness import Effectiveness, effectiveness_in
from hsv.control.tube_law import tube_memory
from hsv.core import Struct, doubles, ffi, lib, records, vector


def written(function: Any, count: int, *arguments: Any) -> np.ndarray:
    """Return the ``count`` numbers that a ``function`` of the core writes to its last argument."""
    out = np.empty(count)
    function(*(doubles(vector(each)) if isinstance(each, np.ndarray) else each for each in arguments), doubles(out))
    return out


def begin_faults(rows: Struct, step: int, seed: int) -> int:
    """Mark in ``rows`` which faults act in a step, and return their number."""
    return int(lib.hsv_begin_faults(rows.pointer, step, seed))


def command_faults(rows: Struct, step: int, seed: int, command: Sequence[float]) -> np.ndarray:
    """Return the command (2) after the command-side faults ``rows``."""
    actuator = np.array(command, float)
    lib.hsv_apply_command_faults(rows.pointer, step, seed, doubles(actuator))
    return actuator


def engine_faults(rows: Struct, step: int, seed: int, alpha: float, mach: float, fuel: float) -> np.ndarray:
    """Return the factors on thrust, lift and drag and the increment of the moment coefficient (4) due to faults."""
    return written(lib.hsv_apply_engine_faults, 4, rows.pointer, step, seed, alpha, mach, fuel)


def move_effectors(
    data: Struct,
    moved: tuple[np.ndarray, np.ndarray],
    rows: Struct,
    step: int,
    substep: float,
    command: np.ndarray,
    alpha: float,
    length: float = 1.0,
) -> None:
    """Move actuators (2, 2) and effectors (2), ``moved``, in place over ``length`` substeps."""
    state, effector = moved
    lib.hsv_move_effectors(
        data.pointer,
        doubles(state),
        rows.pointer,
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
    """Return position, rate and mean position (3) of an actuator, ``h`` (s) after a ``state`` (position, rate).

    ``limits``: smallest and largest position, rate limit, acceleration limit.
    """
    return written(lib.hsv_actuator_step, 3, order, np.array(map), np.array(state), command, *limits, h)


def measure(sensors: Struct, memory: np.ndarray, rows: Struct, step: int, seed: int, x: np.ndarray) -> np.ndarray:
    """Return the measurement (9) of the state ``x`` (9); ``memory`` holds the state of the sensors."""
    known = records("hsv_sensor_memory", memory)
    return written(lib.hsv_measure, 9, sensors.pointer, known, rows.pointer, step, seed, x)


def receive(link: Struct, memory: np.ndarray, step: int, seed: int, payload: np.ndarray) -> np.ndarray:
    """Return the payload that a link delivers in a step in which ``payload`` is sent."""
    taken = np.array(payload, float)
    sizes = len(memory), step, seed
    lib.hsv_receive(link.pointer, doubles(memory), *sizes, doubles(taken), len(taken))
    return taken


def atmosphere_step(
    atmosphere: Struct, memory: np.ndarray, step: int, seed: int, altitude: float, speed: float
) -> np.ndarray:
    """Return forward and upward wind (m/s) and relative density (3) of a period; ``memory`` holds the air's state."""
    given = doubles(memory), step, seed, altitude, speed
    return written(lib.hsv_atmosphere_step, 3, atmosphere.pointer, *given)


def dryden_cross_map(r: float) -> np.ndarray:
    """Return F (2, 2) and the Cholesky factor l11, l21, l22 (7 numbers) of the vertical turbulence over r = V T / L."""
    return written(lib.hsv_dryden_cross_map, 7, r)


def effectiveness_along(data: Struct, states: np.ndarray, inputs: np.ndarray) -> list[Effectiveness]:
    """Return the effectiveness estimates after all steps of a flight: ``states`` (n, 9), commands ``inputs`` (n, 2)."""
    memory, known = tube_memory(), []
    for step, (x, u) in enumerate(zip(states, inputs, strict=True)):
        lib.hsv_effectiveness_step(data.pointer, records("hsv_tube_memory", memory), step, doubles(vector(x)))
        memory["held"] = u
        known.append(effectiveness_in(memory))
    return known


def sine_cosine(x: float) -> tuple[float, float]:
    """Return the core's sine and cosine of ``x`` (rad)."""
    pair = ffi.new("double[2]")
    lib.hsv_sine_cosine(x, pair, pair + 1)
    return pair[0], pair[1]


def philox(counter: Sequence[int], key: Sequence[int]) -> tuple[int, ...]:
    """Return the four Philox words of the ``counter`` (4) under the ``key`` (2)."""
    words = ffi.new("uint64_t[4]")
    lib.hsv_philox(counter, key, words)
    return tuple(words)


def actuator_map(order: int, frequency: float, damping: float, h: float) -> np.ndarray:
    """Return F11, F12, F21, F22, the transition of position minus command and of the rate over ``h`` (s)."""
    return written(lib.hsv_actuator_map, 4, int(order), frequency, damping, h)
