"""The structured disturbance set W (paper eq. 19): a box over the channels of :mod:`hsv.flight.disturbance`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.lmi.semidefinite import outward
from hsv.model.signals import CHANNELS


@dataclass(frozen=True)
class DisturbanceSet:
    """The structured set (paper eq. 19): each of :data:`CHANNELS` between ``lower`` and ``upper``, shape (7,), SI.

    It is computed from the disturbances of some flights; check :func:`~hsv.flight.disturbance.membership` in every
    other flight. Models of hardware and air append further channels to both arrays.
    """

    lower: np.ndarray
    upper: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Mid-points of the bounds by channel; if not zero, as for the one-sided fault, they shift the centre."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths of the bounds, by channel."""
        return 0.5 * (self.upper - self.lower)

    def scaled(self, share: float) -> DisturbanceSet:
        """Return the set with both bounds multiplied by ``share``."""
        return DisturbanceSet(share * self.lower, share * self.upper)

    def report(self) -> dict[str, Any]:
        """Return the bounds by channel, for JSON."""
        return {
            c.name: {"unit": c.unit, "lower": float(low), "upper": float(high)}
            for c, low, high in zip(CHANNELS, self.lower, self.upper, strict=True)
        }

    @classmethod
    def from_report(cls, report: Mapping[str, Any]) -> DisturbanceSet:
        """Return the set that :meth:`report` wrote."""
        return cls(*(np.array([report[c.name][side] for c in CHANNELS], float) for side in ("lower", "upper")))


def widened(lower: np.ndarray, upper: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return both bounds, extended to include zero, multiplied by ``factor`` and rounded away from zero."""
    return outward(factor * np.minimum(lower, 0.0)), outward(factor * np.maximum(upper, 0.0))


@dataclass(frozen=True)
class Extremes:
    """Extremes of c quantities over flights, and the indices of the flights that have them; shape (c,) each."""

    lower: np.ndarray
    upper: np.ndarray
    lower_flight: np.ndarray
    upper_flight: np.ndarray

    @classmethod
    def over(cls, lower: np.ndarray, upper: np.ndarray) -> Extremes:
        """Return the extremes over all flights, given the smallest and largest values (flights, c) of each flight."""
        return cls(lower.min(axis=0), upper.max(axis=0), lower.argmin(axis=0), upper.argmax(axis=0))

    def structured(self, inflation: float) -> DisturbanceSet:
        """Return the structured set between these extremes of the channels, :func:`widened` by ``inflation``."""
        return DisturbanceSet(*widened(self.lower, self.upper, inflation))
