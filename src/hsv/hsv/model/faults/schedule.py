"""Scheduled faults, and the structs with which the core applies them, see ``core/faults.h``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hsv.core import Struct, dtype, lib
from hsv.model.faults.table import FAULT_KINDS, Fault
from hsv.model.signals import INPUT_NAMES, NEVER, STATE_NAMES


class ScheduledFault(NamedTuple):
    """A fault that acts from step ``start`` to step ``stop`` - 1."""

    fault: Fault
    start: int
    stop: int = NEVER


class ActiveFault(NamedTuple):
    """A fault between its start and stop, and its first step; an intermittent fault stays active while it pauses."""

    fault: Fault
    since: int


_NOT_YET = -2.0
_RANKS = {name: rank for rank, name in enumerate(FAULT_KINDS)}
_FIRST_REPLACING = min(_RANKS[name] for name, kind in FAULT_KINDS.items() if kind.replaces)


def fault_rows(
    sides: Sequence[str], scheduled: Sequence[tuple[Fault, int, int]], period: float, earlier: Struct | None = None
) -> Struct:
    """Return the faults of the given ``sides`` as an ``hsv_faults``, in the order in which the core applies them.

    Args:
        sides: Names of sides, see :mod:`hsv.model.faults.table`.
        scheduled: Faults with their first step and the step after their last one, in any order.
        period: Control period T (s).
        earlier: The result before a change in flight; faults that are also in ``scheduled`` keep their memory.
    """
    chosen = sorted((row for row in scheduled if row[0].kind.side in sides), key=_order)
    rows = np.zeros(len(chosen), dtype("hsv_fault"))
    for row, (fault, start, stop) in zip(rows, chosen, strict=True):
        own = len(fault.kind.parameters)
        row["start"], row["stop"], row["channel"], row["code"] = start, stop, _place(fault.channel), fault.kind.code
        row["occurrence"], row["cycle"] = _occurrence(fault.values[own:], period)
        row["parameter"][:own] = fault.values[:own]
    memory = np.zeros(len(rows), dtype("hsv_fault_memory"))
    memory["last"] = memory["onset"] = _NOT_YET
    kept: dict[Any, list[np.void]] = {}
    for row, before in zip(earlier.rows, earlier.memory, strict=True) if earlier else ():
        kept.setdefault(_identity(row), []).append(before)
    for i, row in enumerate(rows) if kept else ():
        # Each of several identical faults keeps its own memory.
        if same := kept.get(_identity(row)):
            memory[i] = same.pop(0)
    return Struct("hsv_faults", rows=rows, memory=memory, period=period)


def _identity(row: np.void) -> bytes:
    """Return the bytes that identify a fault: all but its stop, which changes when the fault is cleared in flight."""
    same = row.copy()
    same["stop"] = 0.0
    return bytes(same.tobytes())


def _place(channel: str) -> int:
    """Return the index of a channel among the inputs or the states; 0 for the engine."""
    return next((names.index(channel) for names in (INPUT_NAMES, STATE_NAMES) if channel in names), 0)


def _order(row: tuple[Fault, int, int]) -> tuple[Any, ...]:
    fault, start, stop = row
    rank = _RANKS[fault.type]
    # Faults that replace the position form a single stage, in which the one that started last comes last.
    stage = (_FIRST_REPLACING, start, rank) if fault.kind.replaces else (rank, start, 0)
    return *stage, fault.channel, fault.values, stop


def _occurrence(values: Sequence[float], period: float) -> tuple[int, tuple[float, float]]:
    cycle, duty, on, off = values
    if cycle > 0.0:
        steps = max(1, round(cycle / period))
        return lib.PERIODIC, (float(steps), float(math.ceil(duty * steps - 1e-9)))
    if on > 0.0:
        return lib.RANDOM, (min(1.0, period / on), min(1.0, period / off))
    return lib.ALWAYS, (0.0, 0.0)
