"""Bounds of the nominal input: the tightened inputs (paper eq. 30), and the region that the tube was computed for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PlanBounds:
    """Bounds of the total nominal input u_r + u_n and of the nominal pitch acceleration, SI.

    ``input_minimum`` and ``input_maximum`` (2): U minus F Z, beyond which the feedback may find no room.
    ``region_minimum`` and ``region_maximum`` (3: both inputs, pitch acceleration): what the certified plans reach. The
    disturbance set is that of flights along those plans; a plan that moves more disturbs more.
    """

    input_minimum: np.ndarray
    input_maximum: np.ndarray
    region_minimum: np.ndarray
    region_maximum: np.ndarray

    @property
    def lower(self) -> np.ndarray:
        """Least inputs (2) inside both."""
        return np.maximum(self.input_minimum, self.region_minimum[:2])

    @property
    def upper(self) -> np.ndarray:
        """Largest inputs (2) inside both."""
        return np.minimum(self.input_maximum, self.region_maximum[:2])

    @property
    def pitch_acceleration(self) -> tuple[float, float]:
        """Least and largest rate of change of the nominal pitch rate, rad/s^2."""
        return float(self.region_minimum[2]), float(self.region_maximum[2])
