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
from hsv.lanes import LaneArray, choose
from hsv.simulation.closed_loop import Components
from hsv.simulation.history import X_N
from hsv.simulation.metrics import FlightData
from hsv.simulation.side_by_side import FlightsSideBySide
from hsv.vehicle.dynamics import PITCH_RATE


@njit_in_flight(nogil=True)
def _worst(
    notch: Any,
    shape: np.ndarray,
    centre: np.ndarray,
    work: Any,
    reference: np.ndarray,
    state: Any,
    deviation: Any,
    first: int,
    rows: Any,
    worst: Any,
) -> None:
    """Write into ``worst`` (1) the largest level of the steps before ``rows`` (1).

    Args:
        notch: The filter.
        shape: P (s, s).
        centre: c (s).
        work: Scratch, three arrays: of the error (s) and of the filters (2 s each).
        reference: x_r (n + 1, 9).
        state: Has x in its first columns.
        deviation: Has x_n in its columns from the ``first`` on.
        first: See there.
        rows: Of each lane.
        worst: Written; not a number where a level is none.
    """
    error, actual, planned = work
    size, rigid = len(centre), len(centre) - len(actual)
    rest(notch, state[0, PITCH_RATE], actual)
    for i in range(len(actual)):
        planned[i] = actual[i]
    worst[0] = -math.inf
    for k in range(len(reference)):
        for i in range(rigid):
            error[i] = state[k, i] - reference[k, i] - deviation[k, first + i] - centre[i]
        for i in range(size - rigid):
            error[rigid + i] = actual[i] - planned[i] - centre[rigid + i]
        value = level(shape, error)
        # What is no number stays it.
        kept = (value <= worst[0]) | (worst[0] != worst[0]) | (rows[0] <= k)
        worst[0] = choose(kept, worst[0], value)
        filter_step(notch, actual, state[k, PITCH_RATE])
        filter_step(notch, planned, reference[k, PITCH_RATE] + deviation[k, first + PITCH_RATE])


class TubeLevels:
    """Levels in the set of one design, for flights that have its filter in the loop and its tube law at the end."""

    def __init__(self, parts: Components) -> None:
        """Read the set from the tube law among the components of the flights, where it is one."""
        law, notch = parts.controller, parts.notch_filter
        self._tube = law.design.tube if isinstance(law, TubeLaw) and notch.sections == law.design.notch else None
        self._notch = notch.data

    def worst(self, flight: FlightData) -> float | None:
        """Return the largest level (e - c)' P (e - c) of the flight, ``None`` where no set holds for it."""
        if self._tube is None:
            return None
        flown = (np.ascontiguousarray(a) for a in (flight.reference, flight.state, flight.deviation))
        worst = np.empty(1)
        self._find(np.empty, *flown, 0, np.array([float(len(flight.state))]), worst)
        return float(worst[0])

    def worst_of(self, group: FlightsSideBySide) -> list[float | None]:
        """Return the same of flights that were flown side by side."""
        first = group.flights[0]
        if self._tube is None or any(flight.trajectory is not first.trajectory for flight in group.flights):
            return [self.worst(flight.data()) for flight in group.flights]
        longest = max(group.flights, key=lambda flight: len(flight.time))
        worst = LaneArray.zeros(1)
        rows = LaneArray(group.rows.astype(float)[None])
        self._find(LaneArray.zeros, longest.reference, group.flown, group.flown, X_N, rows, worst)
        return [float(found) for found in worst.array[0, : len(group.flights)]]

    def _find(self, room: Callable[..., Any], *flown: Any) -> None:
        tube, states = self._tube, 2 * len(self._notch.D)
        assert tube is not None
        work = room(len(tube.centre)), room(states), room(states)
        _worst(self._notch, tube.shape, tube.centre, work, *flown)
