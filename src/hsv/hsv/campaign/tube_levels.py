"""The worst level of a flight in the tube's invariant set, compiled: what TubeStatus says step by step, at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.control.nominal_law import level
from hsv.control.notch_filter import filter_step, rest
from hsv.control.tube_law import TubeLaw
from hsv.lanes import choose
from hsv.simulation.closed_loop import Components
from hsv.simulation.metrics import FlightData
from hsv.vehicle.dynamics import PITCH_RATE


@njit_in_flight(nogil=True)
def worst_level(
    tube: Any,
    work: Any,
    reference: np.ndarray,
    state: Any,
    deviation: Any,
    first: int,
    rows: Any,
    worst: Any,
    start: int,
) -> None:
    """Write into ``worst`` (1) the largest level of the steps before ``rows`` (1).

    A flight may be read in pieces, one after the other.

    Args:
        tube: Filter, P (s, s) and c (s).
        work: Scratch, three arrays: of the error (s) and of the filters (2 s each); the filters are kept.
        reference: x_r (n + 1, 9) from the first step on.
        state: Has x in its first columns.
        deviation: Has x_n in its columns from ``first`` on.
        first: Column of the first component of x_n in ``deviation``.
        rows: Number of steps of the flight, or of the flight of each lane (1).
        worst: Not a number where a level is none.
        start: Step of the first row of ``state`` and ``deviation``.
    """
    notch, shape, centre = tube
    error, actual, planned = work
    size, rigid = len(centre), len(centre) - len(actual)
    if start == 0:
        rest(notch, state[0, PITCH_RATE], actual)
        for i in range(len(actual)):
            planned[i] = actual[i]
        worst[0] = -math.inf
    for k in range(start, min(len(reference), start + len(state))):
        own = k - start
        for i in range(rigid):
            error[i] = state[own, i] - reference[k, i] - deviation[own, first + i] - centre[i]
        for i in range(size - rigid):
            error[rigid + i] = actual[i] - planned[i] - centre[rigid + i]
        value = level(shape, error)
        # What is no number stays it.
        kept = (value <= worst[0]) | (worst[0] != worst[0]) | (rows[0] <= k)
        worst[0] = choose(kept, worst[0], value)
        filter_step(notch, actual, state[own, PITCH_RATE])
        filter_step(notch, planned, reference[k, PITCH_RATE] + deviation[own, first + PITCH_RATE])


class TubeLevels:
    """Levels in the set of one design, for flights that have its filter in the loop and its tube law at the end."""

    def __init__(self, parts: Components) -> None:
        """Read the set from the tube law among the components of the flights, where it is one."""
        law, notch = parts.controller, parts.notch_filter
        tube = law.design.tube if isinstance(law, TubeLaw) and notch.sections == law.design.notch else None
        none = np.empty((0, 0)), np.empty(0)
        self.tube = (notch.data, *((tube.shape, tube.centre) if tube else none))
        """Filter, P and c for :func:`worst_level`; of size zero where no set holds for the flights"""

    @property
    def defined(self) -> bool:
        """Whether a set holds for the flights."""
        return len(self.tube[-1]) > 0

    def work(self, room: Callable[..., Any]) -> tuple[Any, Any, Any]:
        """Return the scratch of :func:`worst_level`, made by ``room``, which takes a shape."""
        notch, _, centre = self.tube
        return room(len(centre)), room(2 * len(notch.D)), room(2 * len(notch.D))

    def worst(self, flight: FlightData) -> float | None:
        """Return the largest level (e - c)' P (e - c) of the flight, ``None`` where no set holds for it."""
        if not self.defined:
            return None
        reference, state, deviation = map(np.ascontiguousarray, (flight.reference, flight.state, flight.deviation))
        rows, worst = np.array([float(len(state))]), np.empty(1)
        worst_level(self.tube, self.work(np.empty), reference, state, deviation, 0, rows, worst, 0)
        return float(worst[0])
