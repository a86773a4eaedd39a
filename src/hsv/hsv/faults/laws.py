"""When faults act and what those on the command and on the engine do, compiled: functions of data, memory and step.

Rows are faults, sorted into the order in which they are composed; a row of the memory is all that a row remembers.
Everything random is drawn at (step, stream) once a period. Faults of effectors are in :mod:`hsv.faults.effectors`,
those of sensors in :mod:`hsv.sensors`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.faults.table import (
    BACKLASH,
    DEAD_ZONE,
    DELAY,
    FAULT_KINDS,
    LONGEST_DELAY,
    LOSS,
    REPLACING,
    REVERSAL,
    THRUST_LOSS,
    UNSTART_OUTSIDE,
    Fault,
)
from hsv.lanes import lane, with_lane
from hsv.noise import STREAMS, uniforms
from hsv.vehicle.dynamics import INPUT_NAMES, STATE_NAMES

ALWAYS, PERIODIC, RANDOM = 0, 1, 2
"""Ways in which a fault occurs between its start and its stop."""

N_PARAMETERS = max(len(kind.parameters) for kind in FAULT_KINDS.values())

ACTING, LAST, ONSET, AWAY, KEPT, SINCE, QUEUE = range(7)
"""Columns of the memory: whether it acts in this step; the last step in which it did; the first of those steps that
follow one another; the state of the Markov chain, 1 while it does not act; what is kept of the signal, and since when;
from the last one on, the delayed signal."""

MEMORY = QUEUE + LONGEST_DELAY + 1
"""Numbers in the memory of a row."""

_NOT_YET = -2.0
_OCCURRENCE = STREAMS["fault_occurrence"]


START, STOP, CHANNEL, CODE, OCCURRENCE = range(5)
PARAMETER = OCCURRENCE + 3
"""Columns of the table of faults: steps [start, stop); channel, which counts among inputs or states; code; occurrence,
:data:`ALWAYS`, or :data:`PERIODIC` with the period and the share of it in steps, or :data:`RANDOM` with the
probabilities of going and of coming in a step; from the last one on, the parameters of the kind."""


class FaultRows(NamedTuple):
    """Faults for compiled functions: a row each of the ``table``, and T, ``period`` (s).

    One array: a compiled function that takes several is slower than what it does with them.
    """

    table: np.ndarray
    period: float


def fault_rows(sides: Sequence[str], scheduled: Sequence[tuple[Fault, int, int]], period: float) -> FaultRows:
    """Return the faults of some ``sides`` among those that are scheduled, in the order of their composition.

    Args:
        sides: Of those in :mod:`hsv.faults.table`.
        scheduled: Faults with the first step and the first step without, in any order.
        period: T (s).
    """
    chosen = sorted((row for row in scheduled if row[0].kind.side in sides), key=_order)
    table = np.zeros((len(chosen), PARAMETER + N_PARAMETERS))
    for row, (fault, start, stop) in zip(table, chosen, strict=True):
        own = len(fault.kind.parameters)
        row[:OCCURRENCE] = start, stop, _place(fault.channel), fault.kind.code
        row[OCCURRENCE:PARAMETER] = _occurrence(fault.values[own:], period)
        row[PARAMETER : PARAMETER + own] = fault.values[:own]
    return FaultRows(table, period)


def _place(channel: str) -> int:
    """Return where a channel is among the inputs or the states; 0 for the engine."""
    return next((names.index(channel) for names in (INPUT_NAMES, STATE_NAMES) if channel in names), 0)


def _order(row: tuple[Fault, int, int]) -> tuple[Any, ...]:
    fault, start, stop = row
    code = fault.kind.code
    # What replaces the position is one stage, in which the newest is last.
    stage = (REPLACING[0], start, code) if code in REPLACING else (code, start, 0)
    return *stage, fault.channel, fault.values, stop


def _occurrence(values: Sequence[float], period: float) -> tuple[float, float, float]:
    cycle, duty, on, off = values
    if cycle > 0.0:
        steps = max(1, round(cycle / period))
        return float(PERIODIC), float(steps), float(math.ceil(duty * steps - 1e-9))
    if on > 0.0:
        return float(RANDOM), min(1.0, period / on), min(1.0, period / off)
    return float(ALWAYS), 0.0, 0.0


def fault_memory(rows: FaultRows, earlier: FaultRows | None = None, memory: np.ndarray | None = None) -> np.ndarray:
    """Return the memory (n, :data:`MEMORY`) of ``rows`` before they act.

    Args:
        rows: Faults of a side.
        earlier: Those that were known before a change in flight, with their ``memory``, which the same faults keep.
        memory: See there.
    """
    kept: dict[tuple[Any, ...], list[np.ndarray]] = {}
    if earlier is not None and memory is not None:
        for i in range(len(earlier.table)):
            kept.setdefault(_identity(earlier, i), []).append(memory[i])
    found = np.zeros((len(rows.table), MEMORY))
    found[:, LAST] = found[:, ONSET] = _NOT_YET
    for i in range(len(found)):
        # Of several that are the same each keeps its own.
        if same := kept.get(_identity(rows, i)):
            found[i] = same.pop(0)
    return found


def _identity(rows: FaultRows, i: int) -> tuple[Any, ...]:
    """Return what tells a fault from others: all but its stop, which a clearance in flight moves."""
    return tuple(value for column, value in enumerate(rows.table[i].tolist()) if column != STOP)


@njit_in_flight(error_model="numpy")
def begin_faults(rows: Any, memory: np.ndarray, step: int, seed: int) -> int:
    """Note in ``memory`` (n, :data:`MEMORY`) which ``rows`` act in ``step``; return how many do."""
    acting = 0
    for i in range(len(rows.table)):
        acts = rows.table[i, START] <= step < rows.table[i, STOP]
        if acts:
            how = rows.table[i, OCCURRENCE]
            if how == PERIODIC:
                acts = (step - rows.table[i, START]) % int(rows.table[i, OCCURRENCE + 1]) < int(
                    rows.table[i, OCCURRENCE + 2]
                )
            elif how == RANDOM:
                if step == rows.table[i, START]:
                    memory[i, AWAY] = 0.0
                else:
                    drawn, _ = uniforms(seed, step, _OCCURRENCE + int(rows.table[i, CODE]), int(rows.table[i, CHANNEL]))
                    away = memory[i, AWAY] == 1.0
                    if drawn < (rows.table[i, OCCURRENCE + 2] if away else rows.table[i, OCCURRENCE + 1]):
                        memory[i, AWAY] = 0.0 if away else 1.0
                acts = memory[i, AWAY] == 0.0
        memory[i, ACTING] = 1.0 if acts else 0.0
        if acts:
            acting += 1
            if memory[i, LAST] != step - 1:
                memory[i, ONSET] = step
            memory[i, LAST] = step
    return acting


@njit_in_flight(error_model="numpy")
def apply_command_faults(rows: Any, memory: np.ndarray, step: int, seed: int, actuator: Any, index: int) -> None:
    """Replace the command (2) in ``actuator`` by what becomes of it on its way to the actuators in ``step``.

    Loss of effectiveness, reversal, delay, dead zone, backlash, in this order (paper eq. 14, eq. 15). Of lanes, that of
    the one with the ``index``.
    """
    if begin_faults(rows, memory, step, seed) == 0:
        return
    for i in range(len(rows.table)):
        if memory[i, ACTING] == 1.0:
            channel = int(rows.table[i, CHANNEL])
            arriving = _commanded(rows, memory, i, step, lane(actuator[channel], index))
            actuator[channel] = with_lane(actuator[channel], index, arriving)


@njit_in_flight(error_model="numpy", inline="always")
def _commanded(rows: Any, memory: np.ndarray, i: int, step: int, command: float) -> float:
    code, value = int(rows.table[i, CODE]), rows.table[i, PARAMETER]
    fresh = memory[i, ONSET] == step
    if fresh:
        memory[i, KEPT] = command
    if code == LOSS:
        ramp, elapsed = rows.table[i, PARAMETER + 1], (step - rows.table[i, START]) * rows.period
        if elapsed < ramp:
            value = 1.0 + (value - 1.0) * (elapsed / ramp)
        return value * command
    if code == REVERSAL:
        return 2.0 * value * memory[i, KEPT] - command
    if code == DELAY:
        size = int(value) + 1
        if fresh:
            for j in range(size):
                memory[i, QUEUE + j] = command
        memory[i, QUEUE + step % size] = command
        return memory[i, QUEUE + (step + 1) % size]
    if code == DEAD_ZONE:
        off = command - memory[i, KEPT]
        if abs(off) <= 0.5 * value:
            return memory[i, KEPT]
        return command - 0.5 * value if off > 0.0 else command + 0.5 * value
    if code == BACKLASH:
        memory[i, KEPT] = min(max(memory[i, KEPT], command - 0.5 * value), command + 0.5 * value)
        return memory[i, KEPT]
    return command


@njit_in_flight(error_model="numpy")
def apply_engine_faults(
    rows: Any,
    memory: np.ndarray,
    step: int,
    seed: int,
    angle_of_attack: float,
    mach: float,
    fuel: float,
    engine: np.ndarray,
) -> None:
    """Write into ``engine`` (4) the factors of thrust, lift and drag and the increment of C_M in ``step``.

    1, 1, 1, 0 while all is well. Losses of thrust and an unstarted inlet multiply; of the aerodynamic effects of
    several unstarts, the last one's hold.

    Args:
        rows: Faults of the engine.
        memory: Theirs.
        step: k.
        seed: Seed of the flight.
        angle_of_attack: rad, of the air.
        mach: Mach number.
        fuel: Equivalence ratio that the engine gets.
        engine: Written.
    """
    engine[0], engine[1], engine[2], engine[3] = 1.0, 1.0, 1.0, 0.0
    if begin_faults(rows, memory, step, seed) == 0:
        return
    for i in range(len(rows.table)):
        if memory[i, ACTING] == 1.0:
            outside = int(rows.table[i, CODE]) == UNSTART_OUTSIDE
            if outside and not _unstarted(rows, memory, i, step, angle_of_attack, mach, fuel):
                continue
            engine[0] *= rows.table[i, PARAMETER]
            if int(rows.table[i, CODE]) != THRUST_LOSS:
                engine[1], engine[2] = rows.table[i, PARAMETER + 1], rows.table[i, PARAMETER + 2]
                engine[3] = rows.table[i, PARAMETER + 3] + rows.table[i, PARAMETER + 4] * angle_of_attack


@njit_in_flight(error_model="numpy", inline="always")
def _unstarted(rows: Any, memory: np.ndarray, i: int, step: int, alpha: float, mach: float, fuel: float) -> bool:
    """Tell whether the inlet is unstarted; KEPT says that it was, SINCE from which step on."""
    if memory[i, ONSET] == step:
        memory[i, KEPT] = 0.0
    off_alpha, off_mach = (
        (alpha - rows.table[i, PARAMETER + 5]) / rows.table[i, PARAMETER + 6],
        (mach - rows.table[i, PARAMETER + 7]) / rows.table[i, PARAMETER + 8],
    )
    distance, limit = off_alpha * off_alpha + off_mach * off_mach, rows.table[i, PARAMETER + 9]
    if memory[i, KEPT] == 0.0:
        if distance > 1.0 or fuel > limit:
            memory[i, KEPT], memory[i, SINCE] = 1.0, step
    else:
        regained = 1.0 - rows.table[i, PARAMETER + 10]
        long_enough = (step - memory[i, SINCE]) * rows.period >= rows.table[i, PARAMETER + 11]
        if long_enough and distance < regained * regained and fuel < regained * limit:
            memory[i, KEPT] = 0.0
    return memory[i, KEPT] == 1.0
