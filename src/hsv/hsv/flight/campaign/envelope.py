"""Envelopes of the signals of all flights without a crash, updated during a campaign; time histories are not stored."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from hsv.flight.metrics import FlightData

WINDOWS = 400
"""Number of time windows of a flight; each keeps minimum and maximum, so that no peak is lost."""


class Signal(NamedTuple):
    """A signal that is drawn on the campaign page: its name and SI unit."""

    name: str
    unit: str


SIGNALS = (
    Signal("altitude_error", "m"),
    Signal("velocity_error", "m/s"),
    Signal("angle_of_attack", "rad"),
    Signal("pitch_angle", "rad"),
    Signal("elastic_rate_1", "kg^0.5 m/s"),
    Signal("elastic_rate_2", "kg^0.5 m/s"),
    Signal("fuel_equivalence_ratio", "1"),
    Signal("elevator_deflection", "rad"),
)


def signals(flight: FlightData) -> np.ndarray:
    """Return the time histories of :data:`SIGNALS` in a flight, shape (signals, steps)."""
    return flight.curves[: len(SIGNALS)]


@dataclass
class Envelope:
    """Minimum, maximum and mean of every signal over several flights, in each time window.

    ``low`` and ``high``, shape (windows, signals), are minimum and maximum. ``total``, shape (windows, signals), is
    the sum of the flights' means in the window, and ``count``, shape (windows,), the number of flights in this sum.
    """

    low: np.ndarray
    high: np.ndarray
    total: np.ndarray
    count: np.ndarray

    @classmethod
    def empty(cls, windows: int = WINDOWS) -> Self:
        """Return an empty envelope, to which flights are added."""
        shape = windows, len(SIGNALS)
        return cls(np.full(shape, np.inf), np.full(shape, -np.inf), np.zeros(shape), np.zeros(windows))

    def add(self, flight: FlightData, steps: int) -> None:
        """Add a flight, planned for ``steps`` steps, to the windows that it reached before its end or divergence."""
        curves = signals(flight)
        rows = curves.shape[1]
        starts = window_starts(steps, len(self.count))
        starts = starts[starts < rows]
        reached = slice(len(starts))
        finite = curves if np.isfinite(curves).all() else np.where(np.isfinite(curves), curves, np.nan)
        self.low[reached] = np.fmin(self.low[reached], np.fmin.reduceat(finite, starts, axis=1).T)
        self.high[reached] = np.fmax(self.high[reached], np.fmax.reduceat(finite, starts, axis=1).T)
        means = np.add.reduceat(finite, starts, axis=1).T / np.diff(starts, append=rows)[:, None]
        complete = np.isfinite(means).all(axis=1)
        self.total[reached][complete] += means[complete]
        self.count[reached] += complete

    def merge(self, other: Envelope) -> None:
        """Add all flights of ``other``."""
        self.low = np.fmin(self.low, other.low)
        self.high = np.fmax(self.high, other.high)
        self.total += other.total
        self.count += other.count

    @property
    def mean(self) -> np.ndarray:
        """Mean of every signal in every window, shape (windows, signals); NaN where ``count`` is 0."""
        with np.errstate(invalid="ignore"):
            return np.where(self.count[:, None] > 0.0, self.total / np.maximum(self.count, 1.0)[:, None], np.nan)

    def encode(self) -> str:
        """Return the envelope as base64 text."""
        return base64.b64encode(np.column_stack((self.low, self.high, self.total, self.count)).tobytes()).decode()

    @classmethod
    def decode(cls, text: str) -> Self:
        """Return the envelope from the text that :meth:`encode` returned; a ``ValueError`` if its size is wrong."""
        s = len(SIGNALS)
        table = np.frombuffer(base64.b64decode(text)).reshape(WINDOWS, 3 * s + 1).copy()
        return cls(table[:, :s], table[:, s : 2 * s], table[:, 2 * s : -1], table[:, -1])


@lru_cache(maxsize=8)
def window_starts(steps: int, windows: int = WINDOWS) -> np.ndarray:
    """Return the first steps of the windows, at most ``windows``, into which ``steps`` steps are divided."""
    starts = np.unique(np.linspace(0, steps + 1, windows, endpoint=False).astype(int))
    starts.setflags(write=False)
    return starts
