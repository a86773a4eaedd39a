"""Actuators and effectors that fail: from the command that reaches them to what the vehicle is given, compiled.

The order is: dynamics with the limits that faults leave, scale, bias, drift, oscillation, what replaces the position
(the newest wins), the stops. It is gone through on every substep; a law gives what holds at the middle of one.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.elementary import sine
from hsv.faults.laws import ACTING, CHANNEL, CODE, KEPT, ONSET, PARAMETER, START, begin_faults
from hsv.faults.table import (
    BANDWIDTH,
    BIAS,
    DRIFT,
    FLOAT,
    HARD_OVER,
    LOCK,
    LOCK_AT,
    OSCILLATION,
    RATE_LIMIT,
    SCALE,
    SOLID_OSCILLATION,
    STOP_LIMIT,
)
from hsv.vehicle.actuators import POSITION, RATE, SUBSTEPS, actuator_map, actuator_step
from hsv.vehicle.integration import advance

_TWO_PI = 6.283185307179586


@njit_in_flight(error_model="numpy")
def move_effectors(
    data: Any,
    state: np.ndarray,
    rows: Any,
    memory: np.ndarray,
    step: int,
    substep: float,
    command: np.ndarray,
    angle_of_attack: float,
    effector: np.ndarray,
    length: float = 1.0,
) -> None:
    """Move the actuators over one substep or a fraction of it; write the result into ``effector`` (2).

    Args:
        data: :class:`hsv.vehicle.actuators.ActuatorData`.
        state: Position and rate of the actuators (2, 2), replaced.
        rows: Faults of dynamics and effectors, of which those act that their ``memory`` says.
        memory: See :mod:`hsv.faults.laws`.
        step: k.
        substep: From 0, where it begins.
        command: Command that reaches the actuators (2).
        angle_of_attack: rad, for what floats along the flow.
        effector: What it was over the substep before; replaced.
        length: Length in substeps.
    """
    n = len(rows.table)
    middle, h = (substep + 0.5 * length) * data.substep, length * data.substep
    for channel in range(len(command)):
        order = data.order[channel]
        map = (data.map[channel, 0], data.map[channel, 1], data.map[channel, 2], data.map[channel, 3])
        frequency, damping = data.natural_frequency[channel], data.damping_ratio[channel]
        minimum, maximum, rate = data.minimum[channel], data.maximum[channel], data.rate_limit[channel]
        changed = length != 1.0
        for i in range(n):
            if memory[i, ACTING] == 1.0 and int(rows.table[i, CHANNEL]) == channel:
                if int(rows.table[i, CODE]) == BANDWIDTH and rows.table[i, PARAMETER] < frequency:
                    frequency = rows.table[i, PARAMETER]
                    order = max(order, 1)
                    changed = True
                elif int(rows.table[i, CODE]) == RATE_LIMIT:
                    rate = min(rate, rows.table[i, PARAMETER])
                elif int(rows.table[i, CODE]) == STOP_LIMIT:
                    minimum, maximum = (
                        max(minimum, rows.table[i, PARAMETER]),
                        min(maximum, rows.table[i, PARAMETER + 1]),
                    )
        if changed and order > 0:
            map = actuator_map(order, frequency, damping, h)
        after, speed, position = actuator_step(
            order,
            map,
            state[channel, POSITION],
            state[channel, RATE],
            command[channel],
            minimum,
            maximum,
            rate,
            data.acceleration_limit[channel],
            h,
        )
        replaced = False
        for i in range(n):
            here = memory[i, ACTING] == 1.0 and int(rows.table[i, CHANNEL]) == channel
            if here and int(rows.table[i, CODE]) >= SCALE:
                if memory[i, ONSET] == step and substep == 0.0:
                    memory[i, KEPT] = effector[channel]
                if int(rows.table[i, CODE]) >= LOCK:
                    replaced = int(rows.table[i, CODE]) != FLOAT
                position = _deflected(rows, memory, i, step, middle, angle_of_attack, position)
        position = min(max(position, data.minimum[channel]), data.maximum[channel])
        if replaced:  # the actuator itself is held, and goes on from there when it is free
            after, speed = position, 0.0
        state[channel, POSITION], state[channel, RATE] = after, speed
        effector[channel] = position


@njit_in_flight(error_model="numpy", inline="always")
def _deflected(rows: Any, memory: np.ndarray, i: int, step: int, middle: float, alpha: float, position: float) -> float:
    """Return what the effector does, ``position`` without this fault, ``middle`` s after the beginning of ``step``."""
    code = int(rows.table[i, CODE])
    elapsed = (step - rows.table[i, START]) * rows.period + middle
    if code == SCALE:
        return rows.table[i, PARAMETER] * position
    if code == BIAS:
        return position + rows.table[i, PARAMETER]
    if code == DRIFT:
        return position + min(
            max(rows.table[i, PARAMETER] * elapsed, -rows.table[i, PARAMETER + 1]), rows.table[i, PARAMETER + 1]
        )
    if code in (OSCILLATION, SOLID_OSCILLATION):
        turns = rows.table[i, PARAMETER + 1] * elapsed
        wave = rows.table[i, PARAMETER] * sine(_TWO_PI * (turns - math.floor(turns)) + rows.table[i, PARAMETER + 2])
        return (position if code == OSCILLATION else memory[i, KEPT]) + wave
    if code == LOCK:
        return memory[i, KEPT]
    if code == LOCK_AT:
        return rows.table[i, PARAMETER]
    if code == FLOAT:
        return -rows.table[i, PARAMETER] * alpha
    if code == HARD_OVER:
        return memory[i, KEPT] + rows.table[i, PARAMETER] * ((step - memory[i, ONSET]) * rows.period + middle)
    return position


@njit_in_flight(error_model="numpy")
def advance_equipped(
    x: Any,
    command: np.ndarray,
    p: Any,
    period: float,
    substeps: int,
    data: Any,
    state: np.ndarray,
    rows: Any,
    memory: np.ndarray,
    step: int,
    seed: int,
    effector: np.ndarray,
    work: Any,
    conditions: Any = None,
    before: Any = None,
    late: float = 0.0,
) -> None:
    """Replace ``x`` (9) by the state one ``period`` (s) later, ``command`` (2) held by what drives the actuators.

    While actuators are ideal, the command is there in time and no fault of theirs acts, the vehicle takes the command,
    within the stops, as :func:`hsv.vehicle.integration.advance` does; else both move on the substeps of the actuators.

    Args:
        x: State, replaced.
        command: Command that reaches the actuators.
        p: Parameters of the vehicle.
        period: T (s).
        substeps: Runge-Kutta steps a period while all is ideal.
        data: :class:`hsv.vehicle.actuators.ActuatorData`.
        state: Position and rate of the actuators (2, 2), replaced.
        rows: Faults of dynamics and effectors.
        memory: Theirs, replaced.
        step: k.
        seed: Seed of the flight.
        effector: What the vehicle was given last (2), replaced.
        work: See :func:`hsv.vehicle.integration.workspace`.
        conditions: Of air and engine (7), held, or none.
        before: The command of the period before (2), where this one may be late.
        late: Substeps after which it is there.
    """
    if begin_faults(rows, memory, step, seed) == 0 and data.ideal and late == 0.0:
        for i in range(len(command)):
            effector[i] = min(max(command[i], data.minimum[i]), data.maximum[i])
            state[i, POSITION], state[i, RATE] = effector[i], 0.0
        advance(x, effector, p, period, substeps, work, conditions)
    else:
        for j in range(SUBSTEPS):
            share = min(max(late - j, 0.0), 1.0)
            if before is not None and share > 0.0:
                move_effectors(data, state, rows, memory, step, j, before, x[2], effector, share)
                advance(x, effector, p, share * data.substep, 1, work, conditions)
            if share < 1.0:
                rest = 1.0 - share
                move_effectors(data, state, rows, memory, step, j + share, command, x[2], effector, rest)
                advance(x, effector, p, rest * data.substep, 1, work, conditions)
