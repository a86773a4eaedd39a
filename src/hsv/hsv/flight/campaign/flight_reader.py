"""Flights side by side that are read while they are flown: only a piece of their histories is in memory at a time."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from hsv.flight.campaign.tube_levels import TubeLevels
from hsv.flight.closed_loop import Components
from hsv.flight.fingerprint import digested, written
from hsv.flight.flight import fault_start, times
from hsv.flight.history import Q_F, X
from hsv.flight.metrics import CURVES, FlightCurves, FlightData, read_curves
from hsv.flight.side_by_side import FlightGroup
from hsv.model.signals import N_STATES

PIECE = 500
"""Rows of a piece: those of 8 flights fit into a second-level cache of a megabyte."""


class FlightReading(NamedTuple):
    """What is read of a flight: curves, last state (9), greatest level in the tube if there is one, fingerprint."""

    curves: FlightCurves
    last: np.ndarray
    level: float | None
    fingerprint: str | None

    @classmethod
    def of(cls, data: FlightData, level: float | None, fingerprint: str | None) -> Self:
        """Return the reading of a flight whose whole history is in memory."""
        return cls(data.flight_curves, data.state[-1], level, fingerprint)


class FlightReader:
    """Flies flights of one campaign side by side, and reads them."""

    def __init__(self, steps: int, levels: TubeLevels) -> None:
        """Make room for flights of so many control periods."""
        self._rows, self._levels = steps + 1, levels
        self._group = FlightGroup(min(PIECE, self._rows))
        self._curves = np.empty((self._group.lanes, CURVES, self._rows))
        self._saturated = np.empty((self._group.lanes, self._rows, 2), bool)

    def read(self, components: Sequence[Components]) -> list[FlightReading]:
        """Fly ``components``, which :meth:`FlightGroup.takes`; the readings are valid until the next ones are flown.

        Raises:
            ValueError: They last longer or shorter than the reader has room for, or are more than there are lanes.
        """
        group, rows, count = self._group, self._rows, len(components)
        if count > group.lanes or components[0].plant.steps + 1 != rows:
            raise ValueError(f"{count} flights of {components[0].plant.steps} steps: expected {rows - 1} steps")
        references = [own.nominal_trajectory.reference.along(rows).state for own in components]
        digests = [hashlib.sha256() for _ in components]
        last = np.empty((count, N_STATES))
        group.begin(components, rows, self._levels.set)
        for start in range(0, rows, PIECE):
            stop = group.fly(start, min(start + PIECE, rows))
            for i in range(count):
                if (end := min(stop, group.ended(i))) > start:
                    flown, beside, _ = group.lane(i).cut(end - start)
                    digests[i].update(digested(flown).data)
                    curves, saturated = self._curves[i, :, start:end], self._saturated[i, start:end]
                    read_curves(flown, beside, references[i][start:end], curves, saturated)
                    last[i] = flown[-1, X:Q_F]
            if stop < min(start + PIECE, rows):
                break
        readings = []
        for i, own in enumerate(components):
            n = group.ended(i)
            time, start_of_fault = times(n, own.plant.period), fault_start(own, n)
            read = FlightCurves(time, self._curves[i, :, :n], self._saturated[i, :n], start_of_fault)
            level = group.worst(i) if self._levels.set else None
            readings.append(FlightReading(read, last[i], level, written(digests[i].digest())))
        return readings
