"""The worst level of a flight in the tube's invariant set, compiled: what TubeStatus says step by step, at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from hsv.control.nominal_law import level
from hsv.control.notch_filter import filter_step, rest
from hsv.control.tube_law import TubeLaw
from hsv.simulation.closed_loop import Components
from hsv.simulation.metrics import FlightData
from hsv.vehicle.dynamics import N_RIGID, PITCH_RATE


@njit(cache=True, nogil=True)
def _worst(
    notch: Any, shape: np.ndarray, centre: np.ndarray, error: np.ndarray, rate: np.ndarray, planned_rate: np.ndarray
) -> float:
    size, rigid = len(centre), error.shape[1]
    actual = np.zeros(size - rigid)
    rest(notch, rate[0], actual)
    planned = actual.copy()
    deviation = np.empty(size)
    worst = -math.inf
    for k in range(len(error)):
        for i in range(rigid):
            deviation[i] = error[k, i] - centre[i]
        for i in range(size - rigid):
            deviation[rigid + i] = actual[i] - planned[i] - centre[rigid + i]
        value = level(shape, deviation)
        if not value <= worst:
            worst = value
        if math.isnan(worst):
            return worst
        filter_step(notch, actual, rate[k])
        filter_step(notch, planned, planned_rate[k])
    return worst


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
        state, reference, deviation = (a[:, :N_RIGID] for a in (flight.state, flight.reference, flight.deviation))
        error = state - reference - deviation
        planned_rate = flight.reference[:, PITCH_RATE] + flight.deviation[:, PITCH_RATE]
        return float(
            _worst(
                self._notch,
                self._tube.shape,
                self._tube.centre,
                error,
                np.ascontiguousarray(flight.state[:, PITCH_RATE]),
                np.ascontiguousarray(planned_rate),
            )
        )
