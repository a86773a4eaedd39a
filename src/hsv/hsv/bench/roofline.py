"""What this processor could do at best with flights side by side, by its arithmetic and its memory (roofline)."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hsv.bench.figure import Figure
from hsv.bench.operations import operations_per_step
from hsv.compiled import njit_in_flight
from hsv.lane_types import REGISTER, WIDTH
from hsv.lanes import LaneArray
from hsv.simulation.assembly import assemble_flight
from hsv.simulation.history import BESIDE, FLOWN
from hsv.simulation.scenario import load_scenario
from hsv.simulation.side_by_side import FlightGroup

_CHAINS = 12
"""Sums that do not wait for one another: enough for two operations a cycle of four cycles each, few enough for 16
registers."""

_ROUNDS = 1_000_000
_COPIED = 256 * 2**20
"""Bytes that are copied: more than the caches hold."""

_BYTES = 8 * (FLOWN + BESIDE)
"""Of the history, a step of a flight: written by the loop, and fetched before that by the processor."""


@njit_in_flight()
def multiply_and_add(x: Any, factor: float, term: float, rounds: int) -> None:
    """Replace each of the twelve elements of ``x`` so many times by its product with ``factor``, plus ``term``."""
    a, b, c, d, e, f, g, h, i, j, k, m = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11]
    for _ in range(rounds):
        a, b, c, d = a * factor + term, b * factor + term, c * factor + term, d * factor + term
        e, f, g, h = e * factor + term, f * factor + term, g * factor + term, h * factor + term
        i, j, k, m = i * factor + term, j * factor + term, k * factor + term, m * factor + term
    x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11] = a, b, c, d, e, f, g, h, i, j, k, m


def operation_rate() -> float:
    """Return the additions and multiplications a second of one core, each rounded, all lanes of its vectors."""
    x: Any = LaneArray(np.zeros((_CHAINS, REGISTER)))
    return 2 * _CHAINS * REGISTER * _ROUNDS / _seconds(lambda: multiply_and_add(x, 0.5, 1.0, _ROUNDS))


def copy_rate() -> float:
    """Return the bytes a second that one core copies from memory to memory."""
    source, target = np.ones(_COPIED // 8), np.ones(_COPIED // 8)
    return _COPIED / _seconds(lambda: np.copyto(target, source))


def against_roofline(repeats: int) -> list[Figure]:
    """Return the flights a second of one thread, side by side and alone, against the most that it could fly.

    A flight takes no less time than its operations at the rate of :func:`operation_rate`, and no less than its history
    at that of :func:`copy_rate`. Divisions and roots count as one operation, though they take many times as long.

    Raises:
        RunError: The operations could not be counted.
    """
    flown = assemble_flight(load_scenario("case1"))
    group, side_by_side = FlightGroup(flown.plant.steps), [flown] * WIDTH
    operations, steps = operations_per_step(), flown.plant.steps + 1
    multiply_and_add(LaneArray(np.zeros((_CHAINS, REGISTER))), 0.5, 1.0, 1)
    group.fly(side_by_side)
    ours, limits, seconds = [], [], []
    for _ in range(repeats):
        by_arithmetic, by_memory = steps * operations / operation_rate(), steps * _BYTES / copy_rate()
        seconds.append((by_arithmetic, by_memory))
        limits.append(1.0 / max(by_arithmetic, by_memory))
        ours.append(WIDTH / _seconds(lambda: group.fly(side_by_side)))
    arithmetic, memory = np.median(seconds, axis=0)
    note = (
        f"{operations} operations a step at {steps * operations / arithmetic / 1e9:.3g} G/s: {1e3 * arithmetic:.3g} ms "
        f"a flight; {_BYTES} bytes a step at {steps * _BYTES / memory / 1e9:.3g} GB/s: {1e3 * memory:.3g} ms"
    )
    what = f"flights of Case 1 a second, compiled loop, {WIDTH} side by side in one thread"
    against = "the most that this core could fly (roofline)"
    return [Figure("roofline", what, against, "1/s", tuple(ours), tuple(limits), "least", note=note)]


def _seconds(job: Callable[[], object]) -> float:
    started = time.thread_time()
    job()
    return time.thread_time() - started
